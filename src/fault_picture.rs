//! `ringwing scenario picture`: draws what a link fault does to a stream of samples.
//!
//! Never imitates a fault: the samples pass the code that an agent receives with.

use crate::{WrongUsage, fault_command::parsed, output::tell};
use ringwing_agent::reception::{ImpairedLink, Route};
use ringwing_bus::write_whole;
use ringwing_drawing::{
    RGBColor,
    chart::{Band, Chart, Curve, Stroke},
};
use ringwing_flight::{LinkCounts, LinkSource, Tick, UavId, UavState};
use ringwing_scenario::{Action, Fault, FaultSchedule, fault::schedule::LinkFault};
use std::path::{Path, PathBuf};

/// Samples a second. More cannot be told apart in a picture; fewer hide what happens to a single one.
const RATE_HZ: u32 = 20;
/// How many samples are sent: 3 s of them, so that the picture shows the link before, during and after the fault.
const SENT: i64 = 60;
/// Ticks after which nothing is on its way any more. Fewer would show a sample that is merely late as lost.
const LAST: i64 = 40 * SENT;
/// When the fault begins, and how long it lasts unless its sentence says so.
const FAULT_AT_S: f64 = 0.5;
const FAULT_FOR_S: f64 = 2.0;
/// Speed of the UAV that sends. At a higher one, an error of a metre disappears in the slope.
const SPEED_M_S: f64 = 10.0;
/// UAVs of the swarm whose links a sentence may name.
const UAVS: u32 = 1024;

const SENT_COLOUR: RGBColor = RGBColor(0x55, 0x55, 0x55);
const WAY_COLOUR: RGBColor = RGBColor(0xc4, 0xd7, 0xe8);
const ARRIVED_COLOUR: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const LOST_COLOUR: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const DAMAGED_COLOUR: RGBColor = RGBColor(0xcc, 0x79, 0xa7);

/// What to draw.
#[derive(Debug, clap::Args)]
pub(crate) struct PictureArgs {
    /// The link fault, such as "link 2->3 delay 200 ms jitter 100 ms"
    sentence: String,
    /// File for the picture, as SVG
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Seed of the fault's draws
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
}

/// Sends samples over the link, draws them, and prints how many arrived.
pub(crate) fn run(args: &PictureArgs) -> anyhow::Result<()> {
    let faults = link_faults(&args.sentence, args.seed)?;
    let route = route(&faults).ok_or_else(|| {
        WrongUsage(format!(
            "{:?}: a picture shows a fault of links, such as \"link 2->3 loss 30 %\"",
            args.sentence
        ))
    })?;
    let stream = Stream::pass(route, &faults, args.seed);
    write(&args.out, &stream.chart(&args.sentence, &faults).svg()?)?;
    tell(&format!("{}: {}", args.out.display(), stream.account()));
    Ok(())
}

/// The faults that the sentence asks for, in the middle of the stream.
fn link_faults(sentence: &str, seed: u64) -> anyhow::Result<Vec<LinkFault>> {
    let mut action = parsed(sentence)?;
    if let Action::Link { for_s, .. } = &mut action {
        for_s.get_or_insert(FAULT_FOR_S);
    }
    if let Some(refusal) = action.refusal(UAVS).or_else(|| action.refusal_at(RATE_HZ)) {
        return Err(WrongUsage(format!("{sentence:?}: {refusal}")).into());
    }
    let faults = [Fault { at_s: FAULT_AT_S, action }];
    Ok(FaultSchedule { faults: &faults, seed, rate_hz: RATE_HZ, uavs: UAVS }.link_faults())
}

/// The first link that the faults concern; a swarm has no others than these.
fn route(faults: &[LinkFault]) -> Option<Route> {
    let fault = faults.first()?;
    let uavs = || UavId::all(UAVS);
    let sources = [LinkSource::LEADER, LinkSource::OWN, LinkSource::TRAFFIC];
    let mut links = uavs()
        .flat_map(|from| uavs().map(move |to| (LinkSource::uav(from), to)))
        .chain(sources.into_iter().flat_map(|from| uavs().map(move |to| (from, to))));
    let (source, to) = links.find(|(source, to)| fault.concerns(*source, *to))?;
    // What a UAV senses itself can be used in the same tick.
    let is_sensed = source == LinkSource::OWN || source == LinkSource::TRAFFIC;
    Some(Route { source, to, latency_ticks: i64::from(!is_sensed) })
}

/// A sample that arrived.
struct Arrival {
    sent: Tick,
    at: Tick,
    x_m: f64,
}

/// What became of the samples of one sender.
struct Stream {
    arrivals: Vec<Arrival>,
    /// The ticks whose samples were damaged.
    damaged: Vec<Tick>,
    counts: LinkCounts,
}

impl Stream {
    /// Sends samples over the link `route` with its faults, until the last one has come or is lost.
    fn pass(route: Route, faults: &[LinkFault], seed: u64) -> Self {
        let mut link = ImpairedLink::new(route, seed, RATE_HZ);
        link.set_faults(faults);
        let (mut arrivals, mut damaged) = (Vec::new(), Vec::new());
        for now in (0..LAST).map(Tick) {
            if now.0 < SENT {
                link.offer(state(now));
            }
            let before = link.counts(now).corrupted;
            link.deliver(now, |sample| {
                arrivals.push(Arrival { sent: sample.tick, at: now, x_m: sample.position_m[0] });
            });
            damaged.extend((link.counts(now).corrupted > before).then_some(now));
        }
        Self { arrivals, damaged, counts: link.counts(Tick(LAST)) }
    }

    fn account(&self) -> String {
        let LinkCounts { offered, delivered, late, lost, duplicated, corrupted, .. } = self.counts;
        let parts = [(late, "late"), (lost, "lost"), (corrupted, "damaged"), (duplicated, "twice")];
        let others = parts.into_iter().filter(|(count, _)| *count > 0);
        let others: Vec<String> = others.map(|(count, what)| format!(", {count} {what}")).collect();
        format!("{offered} samples sent, {delivered} received{}", others.concat())
    }

    /// The ticks whose samples never arrived.
    fn missing(&self) -> impl Iterator<Item = Tick> {
        (0..SENT).map(Tick).filter(|tick| self.arrivals.iter().all(|arrival| arrival.sent != *tick))
    }

    fn chart(&self, sentence: &str, faults: &[LinkFault]) -> Chart {
        let sent = |tick: Tick| Some((tick.seconds(RATE_HZ), state(tick).position_m[0]));
        let (damaged, lost): (Vec<_>, Vec<_>) = self.missing().partition(|tick| self.damaged.contains(tick));
        // A line from what was sent to what arrived: its length along the time is the delay, its height the error.
        let ways = self.arrivals.iter().flat_map(|arrival| [sent(arrival.sent), Some(point(arrival)), None]);
        let arrived = self.arrivals.iter().flat_map(|arrival| [Some(point(arrival)), None]);
        let dots = |ticks: Vec<Tick>| ticks.into_iter().flat_map(|tick| [sent(tick), None]).collect();
        let lines = [
            ("on its way", WAY_COLOUR, Stroke::Solid, ways.collect()),
            ("sent", SENT_COLOUR, Stroke::Solid, (0..SENT).map(|tick| sent(Tick(tick))).collect()),
            ("received", ARRIVED_COLOUR, Stroke::Dotted, arrived.collect()),
            ("lost", LOST_COLOUR, Stroke::Dotted, dots(lost)),
            ("damaged", DAMAGED_COLOUR, Stroke::Dotted, dots(damaged)),
        ];
        let curve = |(name, colour, stroke, points): (&str, _, _, Vec<_>)| {
            (!points.is_empty()).then(|| Curve { name: name.into(), colour, stroke, points })
        };
        Chart {
            x: "time, s",
            y: "position that the sample tells, m",
            lines: lines.into_iter().filter_map(curve).collect(),
            bands: faults.iter().map(|fault| band(sentence, fault)).collect(),
            // Every sample has a point: none may be left out.
            detail: usize::MAX,
            ..Chart::default()
        }
    }
}

fn point(arrival: &Arrival) -> (f64, f64) {
    (arrival.at.seconds(RATE_HZ), arrival.x_m)
}

fn band(sentence: &str, fault: &LinkFault) -> Band {
    let end = fault.end.unwrap_or(Tick(SENT));
    let [from, to] = [fault.begin, end].map(|tick| tick.seconds(RATE_HZ));
    Band { name: sentence.into(), colour: LOST_COLOUR, from, to }
}

/// What the sender tells in `tick`: it flies straight on.
fn state(tick: Tick) -> UavState {
    UavState {
        tick,
        position_m: [SPEED_M_S * tick.seconds(RATE_HZ), 0.0],
        heading_rad: 0.0,
        speed_m_s: SPEED_M_S,
        turn_rate_rad_s: 0.0,
        uav: UavId(1),
        reserved: 0,
        rumours: Default::default(),
    }
}

fn write(path: &Path, svg: &str) -> anyhow::Result<()> {
    write_whole(path, svg).map_err(|error| {
        anyhow::anyhow!("{}: cannot be written: {error}; choose another file with --out", path.display())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(sentence: &str) -> Stream {
        let faults = link_faults(sentence, 1).unwrap();
        Stream::pass(route(&faults).unwrap(), &faults, 1)
    }

    #[test]
    fn a_stream_shows_what_its_fault_does() {
        assert_eq!(stream("link 2->3 blackout for 1 s").account(), "60 samples sent, 40 received, 20 lost");
        assert_eq!(stream("link leader->3 delay 200 ms").account(), "60 samples sent, 60 received, 40 late");
        assert_eq!(
            stream("link own->3 duplicate 100 %").account(),
            "60 samples sent, 100 received, 40 late, 40 twice"
        );
        let damaged = stream("link 2->3 corrupt 50 %");
        assert_eq!(damaged.damaged, damaged.missing().collect::<Vec<_>>());
    }

    #[test]
    fn a_sample_that_waits_for_a_slow_link_is_not_lost() {
        assert_eq!(stream("link 2->3 rate 5 samples/s queue 60").counts.lost, 0);
        assert!(stream("link 2->3 rate 5 samples/s queue 2").missing().count() > 10);
    }

    #[test]
    fn a_fault_of_a_process_has_no_picture() {
        assert!(route(&link_faults("kill uav 3", 1).unwrap()).is_none());
        assert!(link_faults("link 2->3 loss 300 %", 1).is_err());
    }
}
