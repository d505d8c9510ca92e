//! The swarm from above: the circle that is flown, obstacles, slots and UAVs, in the dots of Braille letters.
//!
//! Must never stretch the picture: a circle is round on every terminal.

use super::{model::Model, paint::Paint};
use ratatui::{
    Frame as Picture,
    layout::Rect,
    style::Color,
    symbols::Marker,
    text::Span,
    widgets::canvas::{Canvas, Circle, Context, Line, Points},
};
use ringwing_flight::{Tick, direction};
use ringwing_recorder::{
    metrics::{Frame, TrueState, UavFrame},
    show::{arrow, palette},
};

/// How much of the picture lies beyond the circle that is flown. Less cuts off UAVs beside it; more makes the ring small.
const MARGIN: f64 = 1.35;
/// The length of the line that shows a heading, as a share of the radius. Longer lines hide neighbours.
const HEADING_SHARE: f64 = 0.22;
/// The largest swarm in which every UAV is named. In larger ones, names hide the ring, so only those with news have theirs.
const NAMED_MAX: usize = 12;
/// The dots of a Braille letter, across and down.
const DOTS: (f64, f64) = (2.0, 4.0);

/// Draws the swarm of `model` into `area`.
pub(super) fn draw(picture: &mut Picture, area: Rect, model: &Model) {
    let Some(frame) = model.frame().filter(|_| area.width > 2 && area.height > 1) else { return };
    let window = Window::of(frame, model, area);
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([window.centre[0] - window.half[0], window.centre[0] + window.half[0]])
        .y_bounds([window.centre[1] - window.half[1], window.centre[1] + window.half[1]])
        .paint(|context| paint(context, frame, model, &window));
    picture.render_widget(canvas, area);
}

/// The part of the world that is shown.
struct Window {
    centre: [f64; 2],
    /// From the centre to the edges.
    half: [f64; 2],
    radius_m: f64,
}

impl Window {
    /// The window round the leader that holds the circle and everybody who flies on command.
    fn of(frame: &Frame, model: &Model, area: Rect) -> Self {
        let radius_m = frame.ring.radius_m().unwrap_or_else(|| model.scenario().formation().radius_m());
        // A UAV in its failsafe may fly away. A window that holds it as well would make the ring ever smaller.
        let flying = || (1..).zip(&frame.uavs).filter_map(|(_, uav): (u32, _)| uav.commanded());
        let centre = model.leader().unwrap_or_else(|| mean(flying()));
        let distance = |state: &TrueState| (state.x_m - centre[0]).hypot(state.y_m - centre[1]);
        let reach = flying().map(distance).fold(radius_m, f64::max) * MARGIN;
        let dots = [f64::from(area.width) * DOTS.0, f64::from(area.height) * DOTS.1];
        // One scale for both directions, from the shorter side, so that everything fits and circles stay round.
        let metres_per_dot = 2.0 * reach / dots[0].min(dots[1]);
        Self { centre, half: dots.map(|dots| dots * metres_per_dot / 2.0), radius_m }
    }
}

fn mean<'f>(flying: impl Iterator<Item = &'f TrueState>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0, 0.0], 0.0_f64);
    for state in flying {
        sum = [sum[0] + state.x_m, sum[1] + state.y_m];
        count += 1.0;
    }
    // If nobody flies, the centre is the origin and not NaN.
    sum.map(|sum| sum / count.max(1.0))
}

fn paint(context: &mut Context, frame: &Frame, model: &Model, window: &Window) {
    let paint = Paint::of(model);
    let [x, y] = window.centre;
    context.draw(&Circle { x, y, radius: window.radius_m, color: paint.rgb(palette::QUIET) });
    paint_world(context, Tick(frame.tick), model, window, paint);
    let slots: Vec<(f64, f64)> =
        frame.uavs.iter().filter_map(|uav| uav.commanded()?.slot_m).map(|[x, y]| (x, y)).collect();
    context.draw(&Points { coords: &slots, color: paint.rgb(palette::BRIGHT) });
    for state in frame.uavs.iter().filter_map(|uav| uav.state.as_ref()) {
        paint_uav(context, state, window.radius_m * HEADING_SHARE, paint.rgb(palette::colour(state.uav)));
    }
    for uav in &frame.uavs {
        paint_estimate(context, uav, paint);
    }
    paint_wind(context, frame, model, window, paint);
    // Names come last, on a layer of their own, so that no dots cover them.
    context.layer();
    context.print(x, y, "+");
    for state in frame.uavs.iter().filter_map(|uav| uav.state.as_ref()) {
        if frame.uavs.len() <= NAMED_MAX || !state.is_commanded() {
            context.print(state.x_m, state.y_m, name(state, paint));
        }
    }
}

/// Obstacles and intruders, where they are at `now`.
fn paint_world(context: &mut Context, now: Tick, model: &Model, window: &Window, paint: Paint) {
    let time_s = now.seconds(model.scenario().time.rate_hz);
    let color = paint.rgb(palette::ALARM);
    for obstacle in model.obstacles() {
        let centre = obstacle.route().at(time_s).pose.position;
        context.draw(&Circle { x: centre.x, y: centre.y, radius: obstacle.radius_m, color });
    }
    for intruder in &model.scenario().intruders {
        let pose = intruder.route().at(time_s).pose;
        paint_heading(
            context,
            pose.position.into(),
            pose.heading_rad,
            window.radius_m * HEADING_SHARE,
            color,
        );
        context.print(pose.position.x, pose.position.y, Span::styled("x", paint.bad()));
    }
}

/// A line from a UAV to where its agent believes that it is.
fn paint_estimate(context: &mut Context, uav: &UavFrame, paint: Paint) {
    let estimate = uav.control.as_ref().and_then(|control| control.estimate);
    let (Some(state), Some(estimate)) = (uav.commanded(), estimate) else { return };
    let ends = [[state.x_m, state.y_m], estimate.position.into()];
    paint_line(context, ends, paint.rgb(palette::BRIGHT));
}

/// The arrow of the wind, with its speed.
fn paint_wind(context: &mut Context, frame: &Frame, model: &Model, window: &Window, paint: Paint) {
    let Some(wind_m_s) = frame.wind_m_s() else { return };
    let spacing_m = model.scenario().formation.spacing_m;
    let places = arrow::of_wind(wind_m_s, window.centre.into(), spacing_m, window.radius_m);
    for (from, to) in places.iter().zip(&places[1..]) {
        paint_line(context, [(*from).into(), (*to).into()], paint.rgb(palette::CALM));
    }
    context.print(places[0].x, places[0].y, format!("wind {:.1} m/s", wind_m_s.norm()));
}

fn paint_line(context: &mut Context, [[x1, y1], [x2, y2]]: [[f64; 2]; 2], color: Color) {
    context.draw(&Line { x1, y1, x2, y2, color });
}

fn paint_uav(context: &mut Context, state: &TrueState, length_m: f64, color: Color) {
    paint_heading(context, [state.x_m, state.y_m], state.heading_rad, length_m, color);
}

fn paint_heading(context: &mut Context, [x1, y1]: [f64; 2], heading_rad: f64, length_m: f64, color: Color) {
    let along = direction(heading_rad);
    context.draw(&Line { x1, y1, x2: x1 + length_m * along.x, y2: y1 + length_m * along.y, color });
}

fn name(state: &TrueState, paint: Paint) -> Span<'static> {
    let style = if state.is_commanded() { paint.uav(state.uav) } else { paint.bad() };
    Span::styled(state.uav.to_string(), style)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::{Terminal, backend::TestBackend};
    use ringwing_scenario::{Scenario, Setting, Source};
    use ringwing_simulation::{Frames, Simulation};

    /// The swarm from above after this many seconds.
    fn picture(settings: &[&str], seconds: f64) -> String {
        let settings: Vec<_> = settings.iter().map(|text| Setting::parse(text).unwrap()).collect();
        let scenario = Scenario::read(&Source::find("paper-4.1").unwrap(), &settings).unwrap();
        let mut model = Model::new(scenario.clone(), false);
        let metrics = ringwing_recorder::Metrics::new(&scenario);
        let (mut simulation, mut frames) = (Simulation::new(&scenario).unwrap(), Frames::new(&scenario));
        while simulation.step() && simulation.now().seconds(scenario.time.rate_hz) < seconds {
            if let Some(frame) = frames.take(&simulation) {
                model.take(frame, metrics.moment(), &[], None);
            }
        }
        let mut terminal = Terminal::new(TestBackend::new(60, 30)).unwrap();
        terminal.draw(|picture| draw(picture, picture.area(), &model)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn the_wind_has_an_arrow_with_its_speed() {
        let wind = ["wind.mean_speed_m_s=6", "wind.from_deg=90"];
        assert!(picture(&wind, 0.2).contains("wind 6.0 m/s"));
        assert!(!picture(&[], 0.2).contains("wind"));
    }

    #[test]
    fn an_intruder_is_where_it_is_by_now() {
        // It flies past the leader's start from west to east, and is gone after a second.
        let intruder = [
            "intruders=[{position_m=[0,20],heading_deg=0,speed_m_s=300,cooperative=false}]",
            "time.duration_s=3",
        ];
        assert!(picture(&intruder, 0.2).contains('x'));
        assert!(!picture(&intruder, 2.0).contains('x'));
        assert!(!picture(&intruder[1..], 0.2).contains('x'));
    }
}
