//! Checks every bound of every quantity of a scenario, and how quantities bound each other.
//!
//! Never sees a number that is not finite or too large to compute with: `read` refuses those.

mod agents;
mod formation;
mod intruders;
mod leader_path;
mod manoeuvres;
mod places;
mod sensors;
#[cfg(test)]
mod tests;
mod violation;
mod wind;

pub(crate) use violation::{Blame, Violation};

use crate::{Fault, PathKind, Scenario, fault_check::too_slow};
use ringwing_flight::payload::MAX_UAVS;
use violation::{CheckedQuantity, quantity};

/// The smallest ring: fewer UAVs than 3 have no two different neighbours.
pub const UAVS_MIN: u32 = 3;
/// The largest ring: a larger one does not fit the roster that the processes share.
pub const UAVS_MAX: u32 = MAX_UAVS;
/// The most bytes that may travel besides the messages of a tick. A larger payload would measure the bandwidth of memory
/// instead of the transport.
pub const PAYLOAD_MAX_BYTES: u32 = 65_536;
/// Highest rate. A tick shorter than a millisecond leaves the processes of a swarm too little time to answer in real
/// time.
const RATE_MAX_HZ: f64 = 1000.0;
/// Longest flight. A longer one is a mistake; its log would not fit a disk.
const DURATION_MAX_S: f64 = 24.0 * 3600.0;
/// Longest timeout. A longer one is a mistake: the run would seem to hang.
const TIMEOUT_MAX_S: f64 = 3600.0;
/// Longest name, in characters. A longer one, with the run's identifier behind it, makes unwieldy folders.
const NAME_MAX: usize = 60;
/// Shortest time, in ticks, after which a silent neighbour may count as lost. What a neighbour sends in one tick
/// arrives in the next or the one after, so a shorter time would count healthy neighbours as lost.
const LOSS_TICKS_MIN: u32 = 4;

/// Longest time that the collision filter may look ahead, or wait between two looks. Nothing that is farther ahead can be
/// predicted.
const HORIZON_MAX_S: f64 = 60.0;
/// Longest lag of an airframe. With a longer one it would not follow commands within a flight.
const LAG_MAX_S: f64 = 60.0;
/// Smallest angle between two courses of the collision filter. A smaller one makes each look slow.
const HEADING_STEP_MIN_DEG: f64 = 1.0;

/// Everything that is impossible about `scenario`.
pub(crate) fn violations(scenario: &Scenario) -> Vec<Violation> {
    let mut violations = Vec::new();
    // The order does not matter: the reader sorts the problems by their positions.
    violations.extend(name(scenario));
    violations.extend(description(scenario));
    violations.extend(time(scenario));
    violations.extend(formation::quantities(scenario));
    violations.extend(formation::offsets(scenario));
    violations.extend(manoeuvres::quantities(scenario));
    violations.extend(control(scenario));
    violations.extend(membership(scenario));
    violations.extend(safety(scenario));
    violations.extend(sensing(scenario));
    violations.extend(sensors::quantities(scenario));
    violations.extend(wind::quantities(scenario));
    violations.extend(leader(scenario));
    violations.extend(leader_path::leader_path(scenario));
    violations.extend(airframe(scenario));
    violations.extend(georeference(scenario));
    violations.extend(supervision(scenario));
    violations.extend(ipc(scenario));
    violations.extend(requirements(scenario));
    violations.extend(places::draw(scenario));
    violations.extend(places::obstacles(scenario));
    violations.extend(places::obstacle_field(scenario));
    violations.extend(places::starts(scenario));
    violations.extend(intruders::intruders(scenario));
    violations.extend(agents::agents(scenario));
    violations.extend(faults(scenario));
    // The geometry of wrong quantities has no meaning.
    if violations.is_empty() {
        violations.extend(wind::through_the_air(scenario));
    }
    // A manoeuvre needs what speed the wind leaves over.
    if violations.is_empty() {
        violations.extend(manoeuvres::follow(scenario));
    }
    violations
}

/// What is impossible about the programs of the user's in `scenario`, a sentence each.
pub(crate) fn messages_about_agents(scenario: &Scenario) -> Vec<String> {
    let blames =
        agents::agents(scenario).into_iter().filter_map(|violation| violation.blames.into_iter().next());
    blames.map(|blame| blame.message).collect()
}

/// The name becomes part of a folder's name, so it must be safe on every file system.
fn name(scenario: &Scenario) -> Option<Violation> {
    let name = &scenario.name;
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let fault: String = if name.is_empty() {
        "the name is empty".into()
    } else if name.len() > NAME_MAX {
        format!("the name has more than {NAME_MAX} characters")
    } else if name.starts_with('.') {
        "the name begins with a dot".into()
    } else if !name.chars().all(is_allowed) {
        "the name has characters other than letters, digits, \"-\", \"_\" and \".\"".into()
    } else {
        return None;
    };
    Some(Violation::at("name", format!("{fault}: give a name for a folder, such as \"paper-4.2\"")))
}

fn description(scenario: &Scenario) -> Option<Violation> {
    let is_broken = scenario.description.chars().any(char::is_control);
    let message = "the text has a line break or another control character: give one line";
    is_broken.then(|| Violation::at("description", message))
}

fn time(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let duration = quantity("time.duration_s", scenario.time.duration_s);
    let rate = quantity("time.rate_hz", scenario.time.rate_hz);
    let bad_duration = duration.timeout(DURATION_MAX_S);
    // A wrong duration or rate has a message of its own, and a second one would only repeat it.
    let no_tick =
        (bad_duration.is_none() && scenario.time.rate_hz > 0 && scenario.last_tick() < 1).then(|| {
            let short = format!("{} is less than one tick at {}", duration.measure(), rate.measure());
            let message = format!("{short}: give a longer duration_s or a larger rate_hz");
            Violation::at(duration.key, message.clone()).or_at(rate.key, message)
        });
    [bad_duration, rate.within(1.0..=RATE_MAX_HZ), no_tick].into_iter().flatten()
}

fn angle(key: &str, value_deg: f64) -> Option<Violation> {
    quantity(key, value_deg).within(-360.0..=360.0)
}

fn control(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let control = &scenario.control;
    [
        quantity("control.formation_gain", control.formation_gain).above_zero(),
        quantity("control.slot_gain", control.slot_gain).above_zero(),
        // Unlike the gains of Theorem 1, k may be 0: that turns the repulsion off.
        quantity("control.obstacle_gain_m", control.obstacle_gain_m).not_below_zero(),
        quantity("control.heading_gain_rad_per_m", control.heading_gain_rad_per_m).above_zero(),
        quantity("control.trust_time_s", control.trust_time_s).timeout(TIMEOUT_MAX_S),
        quantity("control.gain_reach_spacings", control.gain_reach_spacings).above_zero(),
        quantity("control.wind_time_s", control.wind_time_s).timeout(TIMEOUT_MAX_S),
    ]
    .into_iter()
    .flatten()
}

fn membership(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let membership = &scenario.membership;
    let loss_timeout = quantity("membership.loss_timeout_s", membership.loss_timeout_s);
    let too_short = || {
        // The timeout has no effect while the ring stays open.
        scenario.control.ring_closes.then(|| shorter_than(loss_timeout, LOSS_TICKS_MIN, scenario)).flatten()
    };
    [
        loss_timeout.timeout(TIMEOUT_MAX_S).or_else(too_short),
        quantity("membership.slots_move_s", membership.slots_move_s).within(0.0..=TIMEOUT_MAX_S),
    ]
    .into_iter()
    .flatten()
}

fn safety(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let safety = &scenario.safety;
    let collision = quantity("airframe.collision_distance_m", scenario.airframe.collision_distance_m);
    let separation = quantity("safety.separation_m", safety.separation_m);
    [
        collision.below(separation),
        // Otherwise UAVs in their slots would avoid each other.
        separation.below(quantity("formation.spacing_m", scenario.formation.spacing_m)),
        quantity("safety.clearance_m", safety.clearance_m).not_below_zero(),
        quantity("safety.horizon_s", safety.horizon_s).timeout(HORIZON_MAX_S),
        quantity("safety.interval_s", safety.interval_s).timeout(HORIZON_MAX_S),
        quantity("safety.acting_interval_s", safety.acting_interval_s).timeout(HORIZON_MAX_S),
        quantity("safety.heading_step_deg", safety.heading_step_deg).within(HEADING_STEP_MIN_DEG..=90.0),
    ]
    .into_iter()
    .flatten()
    // The section has no effect while the filter is off.
    .filter(|_| scenario.control.collision_filter)
}

fn sensing(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let sensing = &scenario.sensing;
    [
        quantity("sensing.traffic_range_m", sensing.traffic_range_m).above_zero(),
        quantity("sensing.traffic_delay_s", sensing.traffic_delay_s).within(0.0..=TIMEOUT_MAX_S),
        quantity("sensing.traffic_loss", sensing.traffic_loss).within(0.0..=1.0),
        quantity("sensing.traffic_noise_m", sensing.traffic_noise_m).not_below_zero(),
        quantity("sensing.traffic_noise_deg", sensing.traffic_noise_deg).within(0.0..=180.0),
        quantity("sensing.radar_range_m", sensing.radar_range_m).above_zero(),
        quantity("sensing.radar_noise_m", sensing.radar_noise_m).not_below_zero(),
        // Two looks of a radar are at least a tick apart.
        shorter_than(quantity("sensing.radar_track_s", sensing.radar_track_s), 1, scenario)
            .or_else(|| quantity("sensing.radar_track_s", sensing.radar_track_s).within(0.0..=TIMEOUT_MAX_S)),
    ]
    .into_iter()
    .flatten()
}

/// Refuses a time that is shorter than `ticks`; the rate may be blamed as well.
fn shorter_than(time: CheckedQuantity<'_>, ticks: u32, scenario: &Scenario) -> Option<Violation> {
    let rate = quantity("time.rate_hz", scenario.time.rate_hz);
    let (span, are) = if ticks == 1 { ("1 tick".into(), "is") } else { (format!("{ticks} ticks"), "are") };
    // A rate of 0 has a message of its own, and would make a tick infinitely long here.
    let has_period = scenario.time.rate_hz > 0;
    (has_period && time.value < f64::from(ticks) * scenario.period_s()).then(|| {
        let short = format!("{} is shorter than {span} at {}", time.measure(), rate.beside(time.key));
        let long = format!("at {}, {span} {are} longer than {}", rate.measure(), time.beside(rate.key));
        Violation::at(time.key, format!("{short}: give a longer time"))
            .or_at(rate.key, format!("{long}: give a larger rate"))
    })
}

/// Assumption 1: the airframes can fly as fast and as slowly as the leader.
fn leader(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let Scenario { leader, airframe, .. } = scenario;
    let speed = quantity("leader.speed_m_s", leader.speed_m_s);
    // A track has its own speeds, which are checked with it.
    let has_speed = leader.path.kind != PathKind::Track;
    let speeds = has_speed.then(|| {
        [
            quantity("airframe.speed_min_m_s", airframe.speed_min_m_s).at_most(speed),
            speed.at_most(quantity("airframe.speed_max_m_s", airframe.speed_max_m_s)),
        ]
    });
    angle("leader.heading_deg", leader.heading_deg).into_iter().chain(speeds.into_iter().flatten().flatten())
}

fn airframe(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let airframe = &scenario.airframe;
    let speed_min = quantity("airframe.speed_min_m_s", airframe.speed_min_m_s);
    let collision = quantity("airframe.collision_distance_m", airframe.collision_distance_m);
    [
        speed_min.above_zero(),
        speed_min.below(quantity("airframe.speed_max_m_s", airframe.speed_max_m_s)),
        quantity("airframe.turn_rate_max_rad_s", airframe.turn_rate_max_rad_s).above_zero(),
        quantity("airframe.speed_lag_s", airframe.speed_lag_s).within(0.0..=LAG_MAX_S),
        quantity("airframe.acceleration_max_m_s2", airframe.acceleration_max_m_s2).not_below_zero(),
        quantity("airframe.turn_lag_s", airframe.turn_lag_s).within(0.0..=LAG_MAX_S),
        quantity("airframe.turn_acceleration_max_rad_s2", airframe.turn_acceleration_max_rad_s2)
            .not_below_zero(),
        // A command arrives once per tick, so a shorter timeout would trigger the failsafe of a healthy UAV.
        shorter_than(quantity("airframe.command_timeout_s", airframe.command_timeout_s), 1, scenario),
        collision.not_below_zero(),
        quantity("airframe.near_miss_distance_m", airframe.near_miss_distance_m).not_below_zero(),
        // Otherwise neighbours in their slots would have collided.
        collision.below(quantity("formation.spacing_m", scenario.formation.spacing_m)),
    ]
    .into_iter()
    .flatten()
}

/// Near the poles, the local frame's axis to the east has no direction.
fn georeference(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let georeference = &scenario.georeference;
    [
        quantity("georeference.latitude_deg", georeference.latitude_deg).within(-85.0..=85.0),
        quantity("georeference.longitude_deg", georeference.longitude_deg).within(-180.0..=180.0),
        quantity("georeference.altitude_m", georeference.altitude_m).within(-500.0..=100_000.0),
    ]
    .into_iter()
    .flatten()
}

fn supervision(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let supervision = &scenario.supervision;
    [
        quantity("supervision.start_timeout_s", supervision.start_timeout_s).timeout(TIMEOUT_MAX_S),
        quantity("supervision.answer_timeout_s", supervision.answer_timeout_s).timeout(TIMEOUT_MAX_S),
    ]
    .into_iter()
    .flatten()
}

fn ipc(scenario: &Scenario) -> Option<Violation> {
    quantity("ipc.payload_bytes", scenario.ipc.payload_bytes).within(0.0..=f64::from(PAYLOAD_MAX_BYTES))
}

fn requirements(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let required = &scenario.requirements;
    [
        ("requirements.clearance_min_m", required.clearance_min_m),
        ("requirements.separation_min_m", required.separation_min_m),
        ("requirements.intruder_distance_min_m", required.intruder_distance_min_m),
        ("requirements.settling_max_s", required.settling_max_s),
        ("requirements.recovery_max_s", required.recovery_max_s),
        ("requirements.slot_error_max_m", required.slot_error_max_m),
        ("requirements.keeping_error_rms_max_m", required.keeping_error_rms_max_m),
    ]
    .into_iter()
    .filter_map(|(key, value)| quantity(key, value?).not_below_zero())
    .chain(
        required.turn_rate_saturated_share_max.and_then(|share| {
            quantity("requirements.turn_rate_saturated_share_max", share).within(0.0..=1.0)
        }),
    )
}

/// A fault that can have no effect is allowed; the reader of the scenario warns of it.
fn faults(scenario: &Scenario) -> Vec<Violation> {
    let mut violations = Vec::new();
    for (index, fault) in scenario.faults.iter().enumerate() {
        violations.extend(quantity(&format!("faults.{index}.at_s"), fault.at_s).not_below_zero());
        if let Some(reason) = fault.action.refusal(scenario.formation.uavs) {
            let action_key = format!("faults.{index}.do");
            // The number of UAVs may be to blame: an override can make the swarm too small for the faults of the file.
            violations.push(Violation::at(action_key, &*reason).or_at("formation.uavs", reason));
        } else if let Some(reason) = rate_refusal(scenario, fault) {
            let action_key = format!("faults.{index}.do");
            violations.push(Violation::at(action_key, &*reason).or_at("time.rate_hz", reason));
        }
    }
    // A fault with an impossible target has no agent to slow.
    if violations.is_empty() {
        violations.extend(slow_answers(scenario));
    }
    violations
}

/// A rate of 0 has a message of its own.
fn rate_refusal(scenario: &Scenario, fault: &Fault) -> Option<String> {
    (scenario.time.rate_hz > 0).then(|| fault.action.refusal_at(scenario.time.rate_hz)).flatten()
}

/// Agents that would be given up because a fault slows them.
fn slow_answers(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    too_slow(scenario).into_iter().map(|(number, reason)| {
        let key = format!("faults.{}.do", number - 1);
        Violation::at(key, &*reason).or_at("supervision.answer_timeout_s", reason)
    })
}
