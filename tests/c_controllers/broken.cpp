// A controller that flies straight on for a second and then breaks, in the way that its first argument names.

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ringwing.h>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

RingwingWish step(void *user, const RingwingSituation *situation) {
  const std::string &how = *static_cast<const std::string *>(user);
  if (situation->time_s >= 1.0) {
    if (how == "throws" || how == "throws-through")
      throw std::runtime_error("out of ideas");
    if (how == "sleeps")
      std::this_thread::sleep_for(std::chrono::hours(1));
    if (how == "exits")
      std::exit(7);
    if (how == "nan")
      return {NAN, 0.0};
    if (how == "notes-wrongly") {
      // One name that is none in the first of these ticks, and one note too many in the others.
      if (situation->time_s < 1.005)
        ringwing_note("not a name", 1.0);
      for (int i = 0; i < 17; ++i)
        ringwing_note(("n" + std::to_string(i)).c_str(), i);
    }
  }
  return {situation->sensed.speed_m_s, 0.0};
}

RingwingWish guarded(void *user, const RingwingSituation *situation) noexcept { return step(user, situation); }

} // namespace

int main(int argc, char **argv) {
  std::string how = argc > 1 ? argv[1] : "";
  const RingwingCallbacks callbacks = {sizeof callbacks, nullptr, how == "throws-through" ? step : guarded};
  return ringwing_controller_main(argc, argv, &callbacks, &how);
}
