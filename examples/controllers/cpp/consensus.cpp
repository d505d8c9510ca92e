// A consensus law in C++, the same as that in ../consensus: a UAV steers for its own slot, and for the place where its
// neighbours, in their slots, would see it.
//
// Start it with `ringwing run paper-4.1 --agent "all=./consensus"`. `--gain` sets how hard it pulls.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ringwing.h>

namespace {

// Share of the disagreement with the neighbours that is added to the error in the slot. More keeps the shape better while all are
// off; too much lets a ring oscillate.
constexpr double neighbour_share = 0.3;
// The largest correction, as a share of the speed of the slot. From 1 on, a UAV far ahead of its slot flies back to it.
constexpr double correction_share = 0.5;
// From the angle between heading and wanted velocity to turn rate. More turns faster; above the tick rate it would oscillate.
constexpr double heading_gain_per_s = 2.0;

struct Consensus {
  // From an error in metres to a velocity.
  double gain_per_s = 0.5;
};

void start(void *user, const RingwingStart *start) noexcept {
  for (size_t i = 0; i + 1 < start->argument_count; ++i)
    if (std::strcmp(start->arguments[i], "--gain") == 0)
      static_cast<Consensus *>(user)->gain_per_s = std::atof(start->arguments[i + 1]);
}

// What to add to the velocity of the slot, in m/s: towards the slot, and towards the distance to each neighbour.
RingwingVector correction(const Consensus &law, const RingwingSituation &s) {
  const RingwingVector own = s.own.position_m;
  RingwingVector error_m = {s.slot.position_m.x - own.x, s.slot.position_m.y - own.y};
  for (const RingwingNeighbour &neighbour : s.neighbours) {
    if (!neighbour.is_heard)
      continue;
    // A state takes a tick to arrive, so predict where the neighbour is now.
    const RingwingVector there = ringwing_track_after(neighbour.track, neighbour.track.age_s).position_m;
    const double x = there.x - own.x, y = there.y - own.y, distance_m = std::max(std::hypot(x, y), 1.0);
    const double pull = (distance_m - neighbour.rest_m) / distance_m * neighbour_share;
    error_m = {error_m.x + x * pull, error_m.y + y * pull};
  }
  return {error_m.x * law.gain_per_s, error_m.y * law.gain_per_s};
}

RingwingWish step(void *user, const RingwingSituation *s) noexcept {
  if (!s->leader.is_heard)
    return {s->sensed.speed_m_s, 0.0};
  const RingwingVector add = correction(*static_cast<Consensus *>(user), *s), slot = s->slot.velocity_m_s;
  // A UAV that is far ahead has to wait for its slot. A larger correction would turn it round.
  const double most_m_s = correction_share * std::hypot(slot.x, slot.y), length = std::hypot(add.x, add.y);
  // The log then shows when the correction is cut.
  ringwing_note("correction_m_s", length);
  const double share = length > most_m_s ? most_m_s / length : 1.0;
  const double x = slot.x + share * add.x, y = slot.y + share * add.y;
  const double angle_rad = std::remainder(std::atan2(y, x) - s->own.heading_rad, 2.0 * std::acos(-1.0));
  return {std::hypot(x, y), s->slot.turn_rate_rad_s + heading_gain_per_s * angle_rad};
}

} // namespace

int main(int argc, char **argv) {
  Consensus law;
  const RingwingCallbacks callbacks = {sizeof callbacks, start, step};
  return ringwing_controller_main(argc, argv, &callbacks, &law);
}
