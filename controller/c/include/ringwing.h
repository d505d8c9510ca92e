// Your own control law in a ringwing flight, for C and C++.
//
// Fill in RingwingCallbacks and call ringwing_controller_main from main. The program then is the agent of a UAV:
// `ringwing run paper-4.1 --agent "3=./mine"` starts it, and restarts, kills and times it like the built-in agent.
//
// Units are in the names: metres, seconds, radians. x points to the east, y to the north, and angles count counterclockwise from
// the x axis.
//
// How this interface grows, without breaking programs that are already built:
//
// - A struct that begins with size_bytes may get new fields at its end. In a struct that ringwing fills in, size_bytes is what this
//   version of the library knows; a program that may run with an older library compares it with the offset of a newer field.
// - Every other struct keeps its layout. What is new gets a struct of its own.
// - Functions and callbacks keep their types. A callback that is NULL is not called.
// - Any other change gets another number in the name of the shared library, libringwing.so.1.
//
// ringwing generates this file from its sources.


#ifndef RINGWING_H
#define RINGWING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// What a controller may know before the flight. It and what it points to are valid until the callback returns.
typedef struct RingwingStart {
  /// The size of this struct in the library. Fields beyond it are not there.
  size_t size_bytes;
  /// The program's own arguments, without its name and without those that ringwing adds.
  char *const *arguments;
  /// How many arguments of its own the program has.
  size_t argument_count;
  /// The whole scenario as TOML, in UTF-8.
  const char *scenario_toml;
  /// What all random draws of the flight come from.
  uint64_t seed;
  /// The length of a tick.
  double period_s;
  /// The number of the UAV that the program will fly, from 1.
  uint32_t uav;
  /// How many UAVs the swarm has.
  uint32_t uavs;
} RingwingStart;

/// What a controller wants its UAV to fly until the next tick.
typedef struct RingwingWish {
  /// Speed along the heading.
  double speed_m_s;
  /// Rate of the heading, counterclockwise.
  double turn_rate_rad_s;
} RingwingWish;

/// A place or a displacement in the local frame.
typedef struct RingwingVector {
  /// To the east.
  double x;
  /// To the north.
  double y;
} RingwingVector;

/// Where an aircraft is, and where it heads.
typedef struct RingwingPose {
  /// Position in the local frame.
  struct RingwingVector position_m;
  /// Heading from the x axis, counterclockwise, in (-pi, pi].
  double heading_rad;
} RingwingPose;

/// Where an aircraft was at one tick, and how it flew on from there.
typedef struct RingwingTrack {
  /// The tick.
  int64_t tick;
  /// How long ago that was.
  double age_s;
  /// Where it was then.
  struct RingwingPose pose;
  /// Its speed along the heading.
  double speed_m_s;
  /// The rate of its heading.
  double turn_rate_rad_s;
} RingwingTrack;

/// What the airframe can do. A wish beyond these limits is cut to them.
typedef struct RingwingLimits {
  /// The lowest speed.
  double speed_min_m_s;
  /// The highest speed.
  double speed_max_m_s;
  /// The highest turn rate, to either side.
  double turn_rate_max_rad_s;
} RingwingLimits;

/// A living ring neighbour.
typedef struct RingwingNeighbour {
  /// The newest state of it that arrived; zero before any arrived.
  struct RingwingTrack track;
  /// L: the distance between its slot and this UAV's slot.
  double rest_m;
  /// Its number, from 1; 0 if there is no such neighbour, as in a ring of two.
  uint32_t uav;
  /// Whether any state of it arrived. Without one, use nothing but its number and its distance.
  bool is_heard;
} RingwingNeighbour;

/// The leader, which is the centre of the formation.
typedef struct RingwingLeader {
  /// The newest state of it that arrived.
  struct RingwingTrack track;
  /// Where it is now, predicted as the scenario allows.
  struct RingwingPose pose;
  /// The heading that a formation in the leader's frame turns with: that of the pose, but without its jumps.
  double frame_rad;
  /// Whether anything was heard of it. Before that, its track and pose, and the slot's position and motion, are zero.
  bool is_heard;
  /// Whether it has been silent for longer than `membership.loss_timeout_s`.
  bool is_silent;
} RingwingLeader;

/// The place of this UAV in the formation.
typedef struct RingwingSlot {
  /// Its place; zero before anything was heard of the leader.
  struct RingwingVector position_m;
  /// Its velocity while the leader flies on as now.
  struct RingwingVector velocity_m_s;
  /// The rate at which that velocity turns.
  double turn_rate_rad_s;
  /// From the leader to the slot.
  struct RingwingVector offset_m;
  /// R: the distance from the leader to the slot.
  double radius_m;
} RingwingSlot;

/// Which UAVs this one believes to be alive.
typedef struct RingwingMembership {
  /// The numbers of the lost UAVs, ascending. Always empty if the scenario's ring does not close after a loss.
  const uint32_t *lost;
  /// How many are lost.
  size_t lost_count;
  /// Fingerprint of `lost`: 0 if it is empty, and equal where two UAVs agree.
  uint64_t lost_fingerprint;
  /// How many UAVs are alive, this one included.
  uint32_t living;
  /// Whether the slots are moving to their new places after a loss or a return.
  bool slots_are_moving;
} RingwingMembership;

/// An obstacle in range of the UAV's sensors.
typedef struct RingwingObstacle {
  /// Its centre.
  struct RingwingVector position_m;
  /// Its velocity; zero for an obstacle that stands.
  struct RingwingVector velocity_m_s;
  /// Its radius.
  double radius_m;
  /// The distance from its centre at which the paper's law begins to avoid it.
  double braking_distance_m;
} RingwingObstacle;

/// Another aircraft in range of the UAV's sensors.
typedef struct RingwingAircraft {
  /// Where it is.
  struct RingwingPose pose;
  /// Its speed along the heading.
  double speed_m_s;
  /// The rate of its heading. Zero for an intruder, and for a UAV that its agent flies.
  double turn_rate_rad_s;
  /// The number of the UAV or of the intruder, from 1.
  uint32_t number;
  /// Whether it is an intruder and not a UAV of the swarm.
  bool is_intruder;
  /// Whether an agent flies it.
  bool is_answering;
} RingwingAircraft;

/// Everything that a controller is told in one tick. It and what it points to are valid until the callback returns.
typedef struct RingwingSituation {
  /// The size of this struct in the library. Fields beyond it are not there.
  size_t size_bytes;
  /// The tick to decide for. Tick 0 begins the flight, and tick -1 is the approach to the start states.
  int64_t tick;
  /// Simulated time since the flight began.
  double time_s;
  /// The length of a tick.
  double period_s;
  /// Where the UAV believes that it is: as sensed, or as estimated from all sensors, and predicted to this tick if the scenario's dead
  /// reckoning is "full".
  struct RingwingPose own;
  /// What the UAV's sensors said last of itself, with all their errors. Its age is 0, unless a fault delays or loses senses.
  struct RingwingTrack sensed;
  /// What the airframe can do.
  struct RingwingLimits limits;
  /// The previous and the next living UAV in the ring.
  struct RingwingNeighbour neighbours[2];
  /// The leader.
  struct RingwingLeader leader;
  /// The UAV's estimate of the wind: zero unless it is told the wind or estimates it. Speeds and headings of UAVs are
  /// through the air; velocities of the leader and of slots are over the ground.
  struct RingwingVector wind_m_s;
  /// The UAV's place in the formation.
  struct RingwingSlot slot;
  /// Who takes part in the ring.
  struct RingwingMembership membership;
  /// The obstacles in range, the nearest first.
  const struct RingwingObstacle *obstacles;
  /// How many obstacles there are.
  size_t obstacle_count;
  /// The other aircraft in range, the nearest first; none without `control.collision_filter`.
  const struct RingwingAircraft *aircraft;
  /// How many aircraft there are.
  size_t aircraft_count;
  /// How many more obstacles are in range; the farthest are left out.
  uint32_t obstacles_omitted;
  /// How many more aircraft are in range; the farthest are left out.
  uint32_t aircraft_omitted;
  /// The number of the UAV that flies, from 1.
  uint32_t uav;
  /// Whether the formation turns with the leader.
  bool formation_turns;
  /// Whether anybody reports other aircraft.
  bool senses_aircraft;
  /// Whether the airframe flies what its agent commands; false while it is in its failsafe.
  bool is_commanded;
} RingwingSituation;

/// The functions of a controller. `user` is what was passed to `ringwing_controller_main`; nothing but these functions uses it. All calls
/// come from the thread that called `ringwing_controller_main`.
///
/// In C++, declare the functions noexcept: an exception that leaves one then ends the program with its message. Otherwise
/// it ends the program without it. A program that cannot fly may also call exit.
typedef struct RingwingCallbacks {
  /// sizeof(RingwingCallbacks), in the header that the program is built with.
  size_t size_bytes;
  /// Called once, before the flight; may be NULL.
  void (*start)(void *user, const struct RingwingStart *start);
  /// Decides for one tick. Called once a tick, in order of ticks, except for ticks in which the UAV does not know where it
  /// is, and those that it missed because its process was frozen.
  struct RingwingWish (*step)(void *user, const struct RingwingSituation *situation);
} RingwingCallbacks;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/// Flies a UAV with the callbacks of the program until the flight ends; to be called once, from main, with the arguments of main.
///
/// Returns the exit code for main: 0 after the flight, 1 if the program cannot take part in the run, 2 if the arguments do
/// not name a run, or if `size_bytes` is not that of this version or step is NULL. What is wrong is on standard error. `user` is
/// passed on to the callbacks and may be NULL.
///
/// # Safety
/// `argv` points to `argc` texts that end with a zero, and `callbacks` to a struct that is filled in. The callbacks can be called
/// with `user`.
int ringwing_controller_main(int argc,
                             char **argv,
                             const struct RingwingCallbacks *callbacks,
                             void *user);

/// Where an aircraft with this track is after `seconds` more, if it holds its speed and turn rate. A negative number leads
/// back. For where a neighbour is now, pass the age of its track.
struct RingwingPose ringwing_track_after(struct RingwingTrack track,
                                         double seconds);

/// Notes a number for the log under a name, such as `slot_error_m`. To be called by step, as often as there are numbers to note.
///
/// Returns whether the log gets the note, if the flight is recorded. A name has 1 to 32 letters, digits and underscores of ASCII,
/// begins with a letter, and is not tick, `time_s` or uav; a tick has at most 16 notes. Any other note is left out, and the run warns
/// of the first one. A second value under the same name replaces the first one. The value may be NaN or infinite. Notes never
/// change the flight.
///
/// # Safety
/// `name` is NULL, which is no name, or points to a text that ends with a zero.
bool ringwing_note(const char *name,
                   double value);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* RINGWING_H */
