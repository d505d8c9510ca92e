//! The picture in the terminal: two lines about the flight, the UAVs, the ring, four courses over time, events, and the keys.
//!
//! Must never need colours: with `NO_COLOR` everything is said in letters as well.

use super::{
    model::{Course, Model, ShownEvent},
    paint::Paint,
    prompt::Prompt,
    ring,
};
use ratatui::{
    Frame as Picture,
    layout::{Constraint, Layout, Rect},
    style::{Modifier, Style},
    text::{Line, Span},
    widgets::{Paragraph, Sparkline, Wrap},
};
use ringwing_flight::Level;
use ringwing_recorder::{metrics::UavFrame, show::palette};

/// The smallest terminal that shows the picture, in columns and rows. On a smaller one, lines would be cut that belong together.
const SMALLEST: (u16, u16) = (60, 16);
/// Columns of the table of UAVs, with a gap after it. Fewer cut the ages; more leave less for the ring.
const TABLE_COLUMNS: u16 = 45;
/// Rows of the head. In one row the state of the flight would not fit 80 columns.
const HEAD_ROWS: u16 = 2;
/// Rows of the courses: their titles, and three of bars.
const COURSE_ROWS: u16 = 4;
/// Steps in which the height of a bar is given. Fewer show as steps; more cannot be seen.
const BAR_STEPS: f64 = 1000.0;

/// Draws the whole picture.
pub(super) fn draw(picture: &mut Picture, model: &Model, prompt: &Prompt) {
    let area = picture.area();
    if area.width < SMALLEST.0 || area.height < SMALLEST.1 {
        let (columns, rows) = SMALLEST;
        let text = format!("make the terminal larger: at least {columns} columns and {rows} rows; q quits");
        picture.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), area);
        return;
    }
    let [head, middle, courses, events, notice, keys] = Layout::vertical([
        Constraint::Length(HEAD_ROWS),
        Constraint::Fill(2),
        Constraint::Length(COURSE_ROWS),
        Constraint::Fill(1),
        Constraint::Length(1),
        Constraint::Length(1),
    ])
    .areas(area);
    let [table, sky] =
        Layout::horizontal([Constraint::Length(TABLE_COLUMNS), Constraint::Fill(1)]).areas(middle);
    let paint = Paint::of(model);
    picture.render_widget(Paragraph::new(headline(model)).style(Paint::head()), head);
    draw_table(picture, table, model);
    ring::draw(picture, sky, model);
    draw_courses(picture, courses, model);
    draw_events(picture, events, model);
    picture.render_widget(Paragraph::new(notice_line(model, prompt)), notice);
    let help = "q quit  p pause/go on  s step  S step 1 s  f fault  +/- log speed  up/down UAVs";
    picture.render_widget(Paragraph::new(help).style(paint.quiet()), keys);
}

/// What flies, and how far it has come.
fn headline(model: &Model) -> String {
    let scenario = model.scenario();
    let uavs = scenario.formation.uavs;
    let when = model.tick().map_or_else(
        || "no tick yet".into(),
        |tick| format!("{:.2} s of {:.0} s, tick {tick}", model.seconds(tick), scenario.time.duration_s),
    );
    let law = scenario.control.law.name();
    format!(
        " {}, {law} law | {} of {uavs} fly\n {} | {when}",
        scenario.name,
        model.commanded(),
        model.pace_text()
    )
}

fn draw_table(picture: &mut Picture, area: Rect, model: &Model) {
    let paint = Paint::of(model);
    let head = Line::styled("uav mode       slot m  prev m  next m  age s", paint.quiet());
    let rows = usize::from(area.height).saturating_sub(1);
    let uavs = model.frame().map_or(&[][..], |frame| &frame.uavs);
    // Keep the table full when it is scrolled to its end.
    let first = model.first_row().min(uavs.len().saturating_sub(rows));
    let lines = (1..).zip(uavs).skip(first).take(rows).map(|(number, uav)| row(number, uav, paint));
    let table: Vec<Line> = std::iter::once(head).chain(lines).collect();
    picture.render_widget(Paragraph::new(table), area);
}

fn row(number: u32, uav: &UavFrame, paint: Paint) -> Line<'static> {
    // The number comes from the place in the frame, because a UAV that has left has no state that names it.
    let name = Span::styled(format!("{number:>3} "), paint.uav(number));
    let Some(state) = &uav.state else {
        return Line::from(vec![name, Span::styled("left the sky", paint.bad())]);
    };
    let mode = format!("{:<10}", state.mode.name());
    let mode = Span::styled(mode, if state.is_commanded() { Style::new() } else { paint.bad() });
    let ages = uav.control.as_ref().map(|control| {
        [control.previous_age_s, control.next_age_s, control.leader_age_s].into_iter().flatten()
    });
    let age_s = ages.and_then(|ages| ages.reduce(f64::max));
    let numbers = [state.slot_error_m, state.previous_distance_m, state.next_distance_m];
    let mut spans = vec![name, mode];
    spans.extend(numbers.map(|number| Span::raw(format!(" {:>7}", shown(number)))));
    spans.push(Span::raw(format!(" {:>5}", shown(age_s))));
    Line::from(spans)
}

/// A number with two decimals, or a dash where it does not exist.
fn shown(number: Option<f64>) -> String {
    number.map_or_else(|| "-".into(), |number| format!("{number:.2}"))
}

fn draw_courses(picture: &mut Picture, area: Rect, model: &Model) {
    let courses = &model.courses;
    let columns = Layout::horizontal([Constraint::Fill(1); 4]).spacing(1).areas::<4>(area);
    let shown = [
        ("slot error", &courses.slot_error_m, "m"),
        ("closest", &courses.closest_m, "m"),
        ("data age", &courses.age_s, "s"),
        ("tick", &courses.latency_us, "us"),
    ];
    for (column, (name, course, unit)) in columns.into_iter().zip(shown) {
        draw_course(picture, column, model, (name, course, unit));
    }
}

fn draw_course(
    picture: &mut Picture,
    area: Rect,
    model: &Model,
    (name, course, unit): (&str, &Course, &str),
) {
    let [title, bars] = Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]).areas(area);
    let newest = course.newest().map_or_else(|| "-".into(), |value| format!("{value:.2} {unit}"));
    picture.render_widget(Paragraph::new(format!("{name} {newest}")), title);
    let values = course.last(usize::from(bars.width));
    let largest = values.iter().copied().fold(0.0, f64::max);
    // Bars are relative to the largest one, which does not exist before the first tick.
    if largest > 0.0 {
        // A sparkline takes whole numbers: in metres, errors below one would vanish.
        let heights: Vec<u64> = values.iter().map(|value| (value / largest * BAR_STEPS) as u64).collect();
        let style = Style::new().fg(Paint::of(model).rgb(palette::CALM));
        picture.render_widget(Sparkline::default().data(heights).max(BAR_STEPS as u64).style(style), bars);
    }
}

fn draw_events(picture: &mut Picture, area: Rect, model: &Model) {
    let paint = Paint::of(model);
    let line = |ShownEvent { time_s, level, text }: &ShownEvent| {
        // In letters, because the colour of the line may be missing.
        let mark = match level {
            Level::Info => "",
            Level::Warning => "warning: ",
            Level::Error => "error: ",
        };
        Line::styled(format!("{time_s:8.2} s  {mark}{text}"), paint.level(*level))
    };
    let lines: Vec<Line> = model.events(usize::from(area.height)).map(line).collect();
    picture.render_widget(Paragraph::new(lines), area);
}

fn notice_line(model: &Model, prompt: &Prompt) -> Line<'static> {
    let strong = Style::new().add_modifier(Modifier::BOLD);
    match prompt {
        Prompt::Closed => Line::raw(model.notice().to_owned()),
        Prompt::Typing(sentence) => {
            Line::styled(format!("fault: {sentence}_   (Enter goes on, Esc leaves)"), strong)
        }
        Prompt::Asking(sentence) => Line::styled(format!("send \"{sentence}\" to the run? y/n"), strong),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::{Terminal, backend::TestBackend};
    use ringwing_flight::{Event, Tick, TimedEvent};
    use ringwing_scenario::Scenario;
    use ringwing_simulation::{Frames, Simulation};

    /// The picture of a flight of six after a second, line by line.
    fn picture(columns: u16, rows: u16, prompt: &Prompt) -> String {
        let scenario = Scenario::default();
        let mut model = Model::new(scenario.clone(), false);
        fly(&scenario, &mut model);
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).unwrap();
        terminal.draw(|picture| draw(picture, &model, prompt)).unwrap();
        terminal.backend().to_string()
    }

    fn fly(scenario: &Scenario, model: &mut Model) {
        let mut metrics = ringwing_recorder::Metrics::new(scenario);
        let (mut simulation, mut frames) = (Simulation::new(scenario).unwrap(), Frames::new(scenario));
        let event = Event::FaultHealed { sentence: "link 2->3 hold".into() };
        let events = [TimedEvent { tick: Tick(50), event }];
        while simulation.step() && simulation.now() < Tick(100) {
            let Some(frame) = frames.take(&simulation) else { continue };
            metrics.observe(frame);
            let events = if frame.tick == 50 { &events[..] } else { &[] };
            model.take(frame, metrics.moment(), events, Some(20.0));
            model.end_batch();
        }
    }

    #[test]
    fn the_picture_fits_a_terminal_of_80_by_24() {
        let picture = picture(80, 24, &Prompt::Closed);
        for text in [
            "unnamed, paper law",
            "of 6 fly",
            "uav mode",
            "  6 commanded",
            "slot error ",
            "closest ",
            "tick 20.00 us",
            "q quit",
            "up/down UAVs",
            "link 2->3 hold",
        ] {
            assert!(picture.contains(text), "no {text:?} in\n{picture}");
        }
        assert!(picture.chars().any(|letter| ('\u{2801}'..='\u{28ff}').contains(&letter)), "{picture}");
        assert!(picture.chars().any(|letter| ('\u{2581}'..='\u{2588}').contains(&letter)), "{picture}");
    }

    #[test]
    fn a_larger_terminal_shows_more_and_one_that_is_too_small_says_so() {
        let large = picture(200, 60, &Prompt::Asking("kill uav 3".into()));
        assert!(large.contains("send \"kill uav 3\" to the run? y/n"), "{large}");
        assert!(picture(40, 10, &Prompt::Closed).contains("make the terminal larger"));
    }
}
