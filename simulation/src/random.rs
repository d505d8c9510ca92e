//! Random scenarios with random faults, for tests, sweeps and fuzzing.
//!
//! Every scenario is valid, and its seed alone decides it. Real processes fly it to the same payloads as a
//! [`Simulation`](crate::Simulation): scheduling never decides how the flight goes. So a scenario never has a fault of
//! the world, never takes the recorder away for long or at the end, and never has an answer so slow that the run gives up
//! waiting.

mod weather;

use ringwing_flight::{FormationFrame, OnLoss, Turn, draw::Draws};
use ringwing_scenario::{
    Action, Failsafe, Fault, IntruderSection, Law, LawSwitches, ManoeuvreSection, ObstacleSection, PathKind,
    Scenario, ShapeName, WaypointSection,
    fault::{Delay, LinkImpairment, Links, ProcessFault, Receiver, Sender, Targets},
};
use std::ops::RangeInclusive;

/// Separates these draws from those of the flight itself ("random" in ASCII). Another value gives other scenarios.
const PURPOSE: [u64; 3] = [0x7261_6e64_6f6d, 0, 0];
/// The longest wait for an answer or for a new process, by the wall clock. If it were shorter, a flight on a busy machine
/// might go on without one.
const PATIENCE_S: f64 = 60.0;
/// The most faults of one flight. More would hide each other: soon no agent would be left to disturb.
const FAULTS_MAX: u32 = 8;
/// The slowest answer, in milliseconds. A slower one only makes flights of processes take longer.
const SLOW_MAX_MS: u32 = 5;

/// The random scenario of `seed`: 3 to 12 UAVs in any shape, 5 to 20 s, either law, up to three listed obstacles and twelve
/// drawn ones, two intruders and eight faults, and a leader that turns in half of them.
pub fn scenario(seed: u64) -> Scenario {
    let mut dice = Dice(Draws::new(seed, PURPOSE, 0));
    let mut scenario = Scenario {
        name: format!("random-{seed}"),
        description: "a random scenario with random faults".into(),
        // TOML has no larger integers.
        seed: seed & i64::MAX.cast_unsigned(),
        ..Scenario::default()
    };
    // All choices come from one stream in this order. A choice that is added before others changes every scenario.
    scenario.time.duration_s = f64::from(dice.whole(5..=20));
    scenario.time.rate_hz = dice.pick(&[50, 100]);
    scenario.formation.uavs = dice.whole(3..=12);
    scenario.formation.spacing_m = dice.number(25.0, 60.0);
    scenario.supervision.answer_timeout_s = PATIENCE_S;
    scenario.supervision.start_timeout_s = PATIENCE_S;
    dice.set_law(&mut scenario);
    dice.set_requirements(&mut scenario);
    scenario.obstacles = (1..=dice.whole(0..=3)).map(|number| dice.obstacle(number, &scenario)).collect();
    let duration_s = scenario.time.duration_s;
    scenario.faults =
        (0..dice.whole(1..=FAULTS_MAX)).map(|_| dice.fault(duration_s, scenario.formation.uavs)).collect();
    dice.set_shape(&mut scenario);
    scenario.obstacles.iter_mut().for_each(|obstacle| dice.set_in_motion(obstacle));
    if dice.one_in(3) {
        scenario.obstacle_field.circles = dice.whole(1..=12);
    }
    scenario.intruders = (0..dice.whole(0..=2)).map(|_| dice.intruder(&scenario)).collect();
    scenario.control.collision_filter ^= dice.one_in(3);
    scenario.sensing.radar_range_m = dice.number(60.0, 200.0);
    scenario.sensing.radar_noise_m = dice.pick(&[0.0, 1.0]);
    dice.set_manoeuvre(&mut scenario);
    dice.set_path(&mut scenario);
    dice.set_wind(&mut scenario);
    dice.break_airframe(&mut scenario);
    dice.set_sensors(&mut scenario);
    dice.drift(&mut scenario);
    scenario
}

/// One stream of draws, from which a scenario takes all its choices in order.
struct Dice(Draws);

impl Dice {
    /// Each number of `range` is equally likely.
    fn whole(&mut self, range: RangeInclusive<u32>) -> u32 {
        let count = range.end() - range.start() + 1;
        range.start() + (self.0.uniform() * f64::from(count)) as u32
    }

    /// Between `low` and `high`, in thousandths, so that sentences of faults stay short.
    fn number(&mut self, low: f64, high: f64) -> f64 {
        ((low + (high - low) * self.0.uniform()) * 1000.0).round() / 1000.0
    }

    fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.whole(0..=choices.len() as u32 - 1) as usize]
    }

    /// True with a probability of one in `count`.
    fn one_in(&mut self, count: u32) -> bool {
        self.whole(1..=count) == 1
    }

    fn set_law(&mut self, scenario: &mut Scenario) {
        let law = self.pick(&[Law::Paper, Law::Resilient]);
        let LawSwitches {
            dead_reckoning,
            trust_fades,
            gain_fades,
            force_limited,
            turn_feed_forward,
            wind_estimated,
            pose_estimated,
            ring_closes,
            collision_filter,
            obstacle_gain_m,
        } = law.switches();
        // Only the reader of scenario files sets the switches of a law, and the agents read only the switches.
        let control = &mut scenario.control;
        control.law = law;
        control.dead_reckoning = dead_reckoning;
        (control.trust_fades, control.gain_fades) = (trust_fades, gain_fades);
        (control.force_limited, control.ring_closes) = (force_limited, ring_closes);
        control.turn_feed_forward = turn_feed_forward;
        control.wind_estimated = wind_estimated;
        control.pose_estimated = pose_estimated;
        control.collision_filter = collision_filter;
        control.obstacle_gain_m = obstacle_gain_m;
        // 0.1 s is five ticks at 50 Hz; validation refuses fewer than four.
        scenario.membership.loss_timeout_s = self.pick(&[0.1, 0.3, 1.0, 3.0]);
        scenario.membership.on_loss =
            self.pick(&[OnLoss::KeepSpacing, OnLoss::KeepRadius, OnLoss::KeepSlots]);
        scenario.membership.slots_move_s = self.pick(&[0.0, 1.0, 5.0]);
        scenario.airframe.failsafe = self.pick(&[Failsafe::Loiter, Failsafe::Hold, Failsafe::Vanish]);
        scenario.airframe.command_timeout_s = self.pick(&[0.05, 0.5, 1.5]);
    }

    /// Lets the leader of half of the flights turn, and half of those formations turn with it. No turn is tighter than the
    /// airframes can fly.
    fn set_path(&mut self, scenario: &mut Scenario) {
        let kinds = [PathKind::Circle, PathKind::FigureEight, PathKind::Racetrack, PathKind::Waypoints];
        if self.one_in(2) {
            return;
        }
        scenario.formation.frame = self.pick(&[FormationFrame::Fixed, FormationFrame::Leader]);
        let least_m = scenario.turn_radius_min_m().unwrap_or_default();
        let path = &mut scenario.leader.path;
        path.kind = self.pick(&kinds);
        path.turn = self.pick(&[Turn::Left, Turn::Right]);
        // A manoeuvre needs speeds that the turn leaves over.
        let reserve = if scenario.manoeuvres.is_empty() { 1.0 } else { 5.0 };
        path.radius_m = (least_m * reserve * self.number(1.01, 3.0)).ceil();
        // Short, so that a flight of a few seconds reaches the first turn.
        path.length_m = self.number(20.0, 100.0);
        // A right angle takes as much of each leg as the radius is long.
        let leg_m = path.radius_m + self.number(20.0, 100.0);
        path.waypoints = [[leg_m, 0.0], [leg_m, leg_m + path.radius_m]]
            .map(|position_m| WaypointSection { position_m })
            .into();
    }

    /// Requires something of half of the flights, so that each verdict occurs.
    fn set_requirements(&mut self, scenario: &mut Scenario) {
        if self.one_in(2) {
            scenario.requirements.collisions_max = Some(self.whole(0..=2));
            scenario.requirements.separation_min_m = Some(self.number(1.0, 10.0));
            scenario.requirements.slot_error_max_m = Some(self.number(1.0, 100.0));
        }
    }

    /// Another shape than the ring for half of the swarms.
    fn set_shape(&mut self, scenario: &mut Scenario) {
        use ShapeName::{Echelon, Ellipse, Grid, Ring, Star, Vee};
        let shape = self.pick(&[Ring, Ring, Ring, Ring, Ring, Ellipse, Star, Vee, Echelon, Grid]);
        // A shape along a path has no radius to keep.
        let has_radius = matches!(shape, Ring | Ellipse | Star);
        if has_radius || scenario.membership.on_loss != OnLoss::KeepRadius {
            scenario.formation.shape = shape;
        }
    }

    /// A manoeuvre for a third of the swarms.
    fn set_manoeuvre(&mut self, scenario: &mut Scenario) {
        let (is_flown, widens, at_s) =
            (self.one_in(3), self.one_in(2), self.number(0.0, scenario.time.duration_s));
        let spacing_m = Some(1.1 * scenario.formation.spacing_m);
        if is_flown && widens {
            scenario.manoeuvres =
                vec![ManoeuvreSection { at_s, over_s: 20.0, spacing_m, ..ManoeuvreSection::default() }];
        } else if is_flown {
            // So slow that airframes can follow from any shape to any other one.
            let (over_s, shape) = (600.0, Some(ShapeName::Star));
            scenario.manoeuvres =
                vec![ManoeuvreSection { at_s, over_s, shape, ..ManoeuvreSection::default() }];
        }
    }

    /// An obstacle ahead of the box that the starts are drawn from, so that they always find room.
    fn obstacle(&mut self, number: u32, scenario: &Scenario) -> ObstacleSection {
        let radius_m = self.number(3.0, 15.0);
        let braking_distance_m = radius_m + self.number(5.0, 30.0);
        let box_end_m = scenario.start.draw.length_radii / 2.0 * scenario.formation().radius_m();
        let east_m = box_end_m + braking_distance_m + self.number(5.0, 150.0);
        let position_m = [east_m, self.number(-60.0, 60.0)];
        ObstacleSection::standing(format!("Obstacle {number}"), position_m, radius_m, braking_distance_m)
    }

    /// Lets half of the obstacles move: on a straight line, or through waypoints.
    fn set_in_motion(&mut self, obstacle: &mut ObstacleSection) {
        match self.whole(1..=4) {
            1 => obstacle.velocity_m_s = [self.number(-8.0, 8.0), self.number(-8.0, 8.0)],
            2 => {
                obstacle.waypoints_m = self.waypoints(obstacle.position_m);
                obstacle.waypoint_speed_m_s = self.number(1.0, 15.0);
                obstacle.repeat = self.one_in(2);
            }
            _ => {}
        }
    }

    /// An aircraft beside the way of the formation that flies across it, circles or follows waypoints.
    fn intruder(&mut self, scenario: &Scenario) -> IntruderSection {
        let box_end_m = scenario.start.draw.length_radii / 2.0 * scenario.formation().radius_m();
        let position_m = [box_end_m + self.number(20.0, 250.0), self.number(-250.0, 250.0)];
        let heading_deg = self.number(-180.0, 180.0);
        let waypoints_m = if self.one_in(3) { self.waypoints(position_m) } else { Vec::new() };
        IntruderSection {
            position_m,
            heading_deg,
            speed_m_s: self.number(5.0, 30.0),
            cooperative: self.one_in(2),
            turn_rate_rad_s: if self.one_in(3) { self.number(-0.3, 0.3) } else { 0.0 },
            waypoints_m,
            repeat: self.one_in(2),
        }
    }

    /// Places near `around_m`.
    fn waypoints(&mut self, around_m: [f64; 2]) -> Vec<[f64; 2]> {
        (0..self.whole(1..=3)).map(|_| around_m.map(|at_m| at_m + self.number(-60.0, 60.0))).collect()
    }

    /// A fault at some time of the flight, or shortly after its end, where it never happens.
    fn fault(&mut self, duration_s: f64, uavs: u32) -> Fault {
        let action = match self.whole(1..=12) {
            1..=5 => self.process_fault(uavs),
            6..=10 => self.link_fault(uavs),
            11 => Action::Heal(if self.one_in(2) { Links::All } else { self.links(uavs) }),
            _ => return self.recorder_freeze(duration_s),
        };
        Fault { at_s: self.number(0.0, 1.05 * duration_s), action }
    }

    fn process_fault(&mut self, uavs: u32) -> Action {
        let for_s = (!self.one_in(4)).then(|| self.number(0.01, 3.0));
        let fault = match self.whole(1..=8) {
            1 => ProcessFault::Kill,
            2 => ProcessFault::Stop,
            3 => ProcessFault::Freeze { for_s },
            4 => ProcessFault::Thaw,
            5 => ProcessFault::Start,
            6 => ProcessFault::Restart { after_s: self.number(0.01, 3.0) },
            7 => ProcessFault::Flap { every_s: self.number(0.2, 2.0), for_s: self.number(0.2, 4.0) },
            _ => {
                // Validation refuses a slow leader, so this fault draws no other targets than UAVs.
                let by_s = f64::from(self.whole(1..=SLOW_MAX_MS)) / 1000.0;
                let fault = ProcessFault::Slow { by_s, for_s: Some(self.number(0.01, 0.5)) };
                return Action::Process { fault, targets: self.some_uavs(uavs) };
            }
        };
        let targets = if self.one_in(4) { Targets::Leader } else { self.some_uavs(uavs) };
        Action::Process { fault, targets }
    }

    /// A recorder that is frozen for longer may miss ticks, and whether it does depends on scheduling. One that is still
    /// frozen at the end is killed, and the run fails because it has no report.
    fn recorder_freeze(&mut self, duration_s: f64) -> Fault {
        let fault = ProcessFault::Freeze { for_s: Some(self.number(0.01, 1.0)) };
        let action = Action::Process { fault, targets: Targets::Recorder };
        // It is thawed at least one second before the end, so that it can catch up.
        Fault { at_s: self.number(0.0, duration_s - 2.0), action }
    }

    fn some_uavs(&mut self, uavs: u32) -> Targets {
        match self.whole(1..=10) {
            1 => Targets::AllUavs,
            2..=4 => Targets::Random(self.whole(1..=2)),
            _ => {
                let count = self.whole(1..=2);
                Targets::Uavs(self.0.choose(count, uavs))
            }
        }
    }

    fn link_fault(&mut self, uavs: u32) -> Action {
        let for_s = (!self.one_in(4)).then(|| self.number(0.01, 5.0));
        Action::Link { links: self.links(uavs), impairment: self.impairment(), for_s }
    }

    fn links(&mut self, uavs: u32) -> Links {
        let (one, other) = self.pair(uavs);
        match self.whole(1..=9) {
            1 => Links::All,
            2 => Links::From(Sender::All, Receiver::All),
            3 => Links::From(Sender::Leader, self.receiver(one)),
            4..=5 => Links::From(Sender::Own, self.receiver(one)),
            6 => Links::From(Sender::Uav(one), Receiver::Uav(other)),
            // The grammar writes the lower number first.
            7 => Links::Between(one.min(other), one.max(other)),
            8 => Links::Isolate(one),
            _ => {
                // Each of the two groups has at least one UAV.
                let cut = self.whole(1..=uavs - 1);
                Links::Partition(vec![(1..=cut).collect(), (cut + 1..=uavs).collect()])
            }
        }
    }

    /// Two different UAVs in either order. Half of the pairs are ring neighbours, because hardly any others listen to each
    /// other.
    fn pair(&mut self, uavs: u32) -> (u32, u32) {
        let drawn = self.0.choose(2, uavs);
        // The drawn ones are in order, and the last UAV is a neighbour of the first.
        let (one, other) =
            if self.one_in(2) { (drawn[1], drawn[1] % uavs + 1) } else { (drawn[0], drawn[1]) };
        if self.one_in(2) { (one, other) } else { (other, one) }
    }

    /// All agents, or that of `uav`.
    fn receiver(&mut self, uav: u32) -> Receiver {
        if self.one_in(2) { Receiver::All } else { Receiver::Uav(uav) }
    }

    fn impairment(&mut self) -> LinkImpairment {
        match self.whole(1..=16) {
            1..=3 => LinkImpairment::Delay(self.delay()),
            4 => LinkImpairment::Loss(self.number(0.05, 0.9)),
            5 => LinkImpairment::Gilbert {
                p: self.number(0.01, 0.2),
                r: self.number(0.01, 0.2),
                h: self.number(0.0, 0.2),
                k: self.number(0.8, 1.0),
            },
            6..=7 => LinkImpairment::Blackout,
            8 => LinkImpairment::Duplicate(self.number(0.05, 0.9)),
            9 => LinkImpairment::Reorder { p: self.number(0.05, 0.9), by_s: self.number(0.01, 0.2) },
            10 => LinkImpairment::Hold,
            11 => LinkImpairment::Stuck,
            12 => LinkImpairment::Bias {
                x_m: self.number(-5.0, 5.0),
                y_m: self.number(-5.0, 5.0),
                heading_rad: self.number(-0.2, 0.2),
            },
            13 => LinkImpairment::GilbertBurst {
                loss: self.number(0.01, 0.5),
                // One tick at 50 Hz is 20 ms; validation refuses shorter bursts.
                burst_s: self.number(0.02, 0.5),
            },
            14 => LinkImpairment::Corrupt(self.number(0.05, 0.9)),
            15 => LinkImpairment::Rate { samples_per_s: self.number(1.0, 60.0), queue: self.whole(1..=20) },
            _ => LinkImpairment::Noise {
                position_m: self.number(0.0, 3.0),
                heading_rad: self.number(0.0, 0.1),
            },
        }
    }

    fn delay(&mut self) -> Delay {
        let by_s = self.number(0.0, 1.0);
        match self.whole(1..=5) {
            1 => Delay::Constant { by_s },
            // The grammar refuses a jitter, a deviation or a tail of 0.
            2 => Delay::Uniform { by_s, jitter_s: self.number(0.001, 0.5) },
            3 => Delay::Normal { by_s, deviation_s: self.number(0.001, 0.3) },
            4 => Delay::Pareto { by_s, tail_s: self.number(0.01, 0.3), shape: self.number(1.1, 4.0) },
            _ => Delay::Trace((0..self.whole(1..=5)).map(|_| self.number(0.0, 0.3)).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Enough seeds for the rarest choice to occur.
    const SEEDS: std::ops::Range<u64> = 0..300;

    #[test]
    fn every_scenario_is_valid_and_its_seed_alone_decides_it() {
        for seed in SEEDS.chain([u64::MAX]) {
            let drawn = scenario(seed);
            assert_eq!(drawn, scenario(seed));
            assert_eq!(Scenario::resolved(&drawn.to_toml()).unwrap(), drawn, "seed {seed}");
            assert_eq!(drawn.name, format!("random-{seed}"));
        }
        assert_ne!(scenario(1).faults, scenario(2).faults);
    }

    #[test]
    fn obstacles_stand_drift_and_fly_round() {
        let obstacles: Vec<_> = SEEDS.flat_map(|seed| scenario(seed).obstacles).collect();
        let occurs = |is: &dyn Fn(&ObstacleSection) -> bool| obstacles.iter().any(is);
        assert!(occurs(&|one| !one.moves()) && occurs(&|one| one.velocity_m_s != [0.0; 2]));
        assert!(occurs(&|one| one.repeat) && occurs(&|one| one.waypoints_m.len() == 3 && !one.repeat));
    }

    #[test]
    fn intruders_of_each_kind_meet_swarms_with_a_filter() {
        assert!(SEEDS.map(scenario).any(|scenario| !scenario.obstacle_field.is_empty()));
        let filtered = SEEDS.map(scenario).filter(|scenario| scenario.control.collision_filter);
        let intruders: Vec<_> = filtered.flat_map(|scenario| scenario.intruders).collect();
        for cooperative in [false, true] {
            let occurs = |is: &dyn Fn(&IntruderSection) -> bool| {
                intruders.iter().any(|one| one.cooperative == cooperative && is(one))
            };
            assert!(occurs(&|one| !one.waypoints_m.is_empty()) && occurs(&|one| one.turn_rate_rad_s != 0.0));
        }
    }

    #[test]
    fn every_kind_of_fault_occurs() {
        let sentences: Vec<String> =
            SEEDS.flat_map(|seed| scenario(seed).faults).map(|fault| fault.action.to_string()).collect();
        let words: BTreeSet<&str> = sentences.iter().flat_map(|sentence| sentence.split(' ')).collect();
        for word in [
            "kill",
            "stop",
            "freeze",
            "thaw",
            "start",
            "restart",
            "flap",
            "slow",
            "link",
            "partition",
            "isolate",
            "heal",
            "leader",
            "recorder",
            "random",
            "all",
            "own->all",
            "leader->all",
            "all->all",
            "delay",
            "jitter",
            "normal",
            "pareto",
            "trace",
            "loss",
            "gilbert",
            "blackout",
            "duplicate",
            "reorder",
            "hold",
            "stuck",
            "bias",
            "noise",
            "burst",
            "corrupt",
            "rate",
        ] {
            assert!(words.contains(word), "no {word}");
        }
    }

    #[test]
    fn every_path_of_the_leader_but_a_track_occurs_in_both_frames() {
        let drawn: BTreeSet<String> = SEEDS
            .map(scenario)
            .map(|scenario| format!("{:?} {:?}", scenario.leader.path.kind, scenario.formation.frame))
            .collect();
        assert_eq!(drawn.len(), 9, "a straight path has no need of the leader's frame: {drawn:?}");
    }

    #[test]
    fn single_links_lead_up_and_down_and_round_the_end_of_the_ring() {
        let (mut up, mut down, mut wrapped) = (0, 0, 0);
        for scenario in SEEDS.map(scenario) {
            for Fault { action, .. } in &scenario.faults {
                let Action::Link { links: Links::From(Sender::Uav(from), Receiver::Uav(to)), .. } = action
                else {
                    continue;
                };
                *if from < to { &mut up } else { &mut down } += 1;
                wrapped += u32::from(from.abs_diff(*to) == scenario.formation.uavs - 1);
            }
        }
        assert!(up > 10 && down > 10 && wrapped > 0, "{up} up, {down} down, {wrapped} round the end");
    }

    #[test]
    fn no_scenario_has_a_fault_whose_effect_depends_on_chance() {
        let faults = SEEDS.map(scenario).flat_map(|scenario| {
            let duration_s = scenario.time.duration_s;
            scenario.faults.into_iter().map(move |fault| (fault, duration_s))
        });
        for (Fault { at_s, action }, duration_s) in faults {
            let Action::Process { fault, targets } = action else { continue };
            assert_ne!(targets, Targets::World);
            let ends_early = |for_s: f64| for_s <= 1.0 && at_s + for_s < duration_s;
            let is_harmless =
                matches!(fault, ProcessFault::Freeze { for_s: Some(for_s) } if ends_early(for_s));
            assert!(targets != Targets::Recorder || is_harmless, "{fault:?}");
            assert!(!matches!(fault, ProcessFault::Slow { by_s, .. } if by_s > 0.1), "{fault:?}");
        }
    }
}
