//! From text to scenario, or to all that is wrong with it at once.
//!
//! The text becomes a tree whose values know where they were written; overrides are put into it; what has not the right
//! shape is noted and replaced, so that the rest can still be judged: by the deserializer, then by `validate`.

use crate::{
    Fault, Place, Problem, Scenario, ScenarioError, Setting, Source, example,
    fault::trace,
    flaw::{Flaw, View},
    origin::{self, Origins},
    setting, shape, switch, validate,
};
use serde::Deserialize;
use toml::{
    Spanned,
    de::{DeTable, DeValue, Error, ValueDeserializer},
};

type Tree<'a> = Spanned<DeValue<'a>>;

impl Scenario {
    /// Reads a scenario, with `settings` in place of what the source says, later ones in place of earlier ones.
    ///
    /// When a setting of `formation.uavs` asks for another number of UAVs than the source lists starts for, the list
    /// counts no longer: `start.uavs` is empty, and starts are drawn. In the same way, when a setting of `control.law` asks
    /// for another law than the source does, the source's switches of that law count no longer.
    pub fn read(source: &Source, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let mut reading = Reading::new(source, settings);
        let scenario = reading.scenario();
        reading.result(scenario)
    }

    /// The same with further `faults`, and every file of delays read.
    pub fn with_faults(mut self, faults: &[Fault]) -> Result<Self, ScenarioError> {
        let refusal = |fault: &Fault| {
            let message = fault.action.refusal(self.formation.uavs)?;
            let place = Place::Setting(format!("--fault \"{fault}\""));
            Some(Problem { scenario: self.name.clone(), place, key: None, message })
        };
        let problems: Vec<_> = faults.iter().filter_map(refusal).collect();
        if !problems.is_empty() {
            return Err(problems.into());
        }
        self.faults.extend_from_slice(faults);
        trace::read_all(&mut self.faults).map_err(|why| Problem::of_scenario(&self.name, why))?;
        Ok(self)
    }

    /// Reads what [`Scenario::to_toml`] wrote.
    pub fn resolved(text: &str) -> Result<Self, ScenarioError> {
        Self::read(&Source { name: "scenario.toml".into(), text: text.into() }, &[])
    }
}

/// A scenario while it is read.
struct Reading<'s> {
    source: &'s Source,
    settings: &'s [Setting],
    origins: Origins<'s>,
    /// With the position of each, which gives their order.
    problems: Vec<(Option<usize>, Problem)>,
    /// Keys that are known to be wrong: what they stand for is not to be judged any further.
    flawed: Vec<String>,
}

impl<'s> Reading<'s> {
    fn new(source: &'s Source, settings: &'s [Setting]) -> Self {
        let origins = Origins::new(&source.text, settings);
        Self { source, settings, origins, problems: Vec::new(), flawed: Vec::new() }
    }

    /// What can be made of it; right only when no problem was noted.
    fn scenario(&mut self) -> Option<Scenario> {
        let mut tree = self.parse()?;
        let law_written = switch::law(tree.get_ref());
        let (list_counts, keys) = self.apply_settings(&mut tree);
        if keys.iter().any(|key| key == switch::LAW) && switch::law(tree.get_ref()) != law_written {
            switch::drop_unset(tree.get_mut(), &keys);
        }
        switch::complete(&mut tree);
        let given = tree.clone();
        self.fit(&mut tree);
        if !list_counts {
            drop_list(tree.get_mut());
        }
        let scenario = self.deserialize(tree, given.get_ref())?;
        self.validate(&scenario, given.get_ref());
        Some(scenario)
    }

    fn result(mut self, scenario: Option<Scenario>) -> Result<Scenario, ScenarioError> {
        self.problems.sort_by_key(|(position, _)| *position);
        let problems: Vec<_> = self.problems.into_iter().map(|(_, problem)| problem).collect();
        match scenario {
            Some(scenario) if problems.is_empty() => Ok(scenario),
            _ => Err(problems.into()),
        }
    }

    fn note(&mut self, position: Option<usize>, key: Option<String>, message: String) {
        let place = position.map_or(Place::Scenario, |position| self.origins.place(position));
        self.flawed.extend(key.clone());
        self.problems.push((position, Problem { scenario: self.source.name.clone(), place, key, message }));
    }

    /// The text as a tree, if it is TOML.
    fn parse(&mut self) -> Option<Tree<'s>> {
        let (table, mut errors) = DeTable::parse_recoverable(&self.source.text);
        errors.sort_by_key(position);
        for error in &errors {
            self.note_syntax(error);
        }
        errors.is_empty().then(|| Spanned::new(0..0, DeValue::Table(table.into_inner())))
    }

    /// Of several errors on a line only the first is noted: the others follow from it.
    fn note_syntax(&mut self, error: &Error) {
        let position = position(error).unwrap_or(self.source.text.len());
        let place = self.origins.place(position);
        if self.problems.last().is_none_or(|(_, last)| last.place != place) {
            let message = syntax_message(&self.source.text, position, error.message());
            self.note(Some(position), None, message);
        }
    }

    /// Puts the overrides into the tree. Returns whether the listed starts still count, and the keys that were set.
    fn apply_settings(&mut self, tree: &mut Tree<'s>) -> (bool, Vec<String>) {
        let mut keys = Vec::new();
        for (index, setting) in self.settings.iter().enumerate() {
            match self.apply(index, setting, tree) {
                Ok(key) => keys.push(key),
                Err(message) => {
                    let position = self.origins.mark(index).start;
                    self.note(Some(position), Some(setting.key.clone()), message);
                }
            }
        }
        let list_set = keys.iter().any(|key| key.starts_with("start.uavs"));
        let number_set = keys.iter().any(|key| key == "formation.uavs");
        (list_set || !number_set || list_is_as_long_as_said(tree.get_ref()), keys)
    }

    fn apply(&mut self, index: usize, setting: &'s Setting, tree: &mut Tree<'s>) -> Result<String, String> {
        let key = setting.full_key()?;
        let value = shape::value_of(&setting.value, example::at(&key));
        setting::put(tree, &key, self.origins.marked(value, index))?;
        Ok(key)
    }

    fn fit(&mut self, tree: &mut Tree<'s>) {
        let mut misfits = Vec::new();
        shape::fit(tree, example::tree(), "", &mut misfits);
        for misfit in misfits {
            self.note(Some(misfit.position), Some(misfit.key), misfit.message);
        }
    }

    /// Deserializes the tree; each value that is refused is noted and replaced, until none is.
    fn deserialize(&mut self, mut tree: Tree<'s>, given: &DeValue<'_>) -> Option<Scenario> {
        loop {
            let error = match Scenario::deserialize(ValueDeserializer::from(tree.clone())) {
                Ok(scenario) => return Some(scenario),
                Err(error) => error,
            };
            let key = error.span().and_then(|span| origin::key_at(given, &span));
            let known =
                key.filter(|key| !self.is_flawed(key)).and_then(|key| Some((example::at(&key)?, key)));
            let Some((wanted, key)) = known else {
                self.note(position(&error), None, error.message().into());
                return None;
            };
            let message = if is_sentence(&key) {
                error.message().to_owned()
            } else {
                refusal(error.message(), origin::trace(given, &key).value, &key, wanted)
            };
            self.note(position(&error), Some(key.clone()), message);
            setting::put(&mut tree, &key, Spanned::new(0..0, wanted.clone())).ok()?;
        }
    }

    fn validate(&mut self, scenario: &Scenario, given: &DeValue<'_>) {
        let mut flaws = validate::flaws(scenario);
        flaws.retain(|flaw| !flaw.keys().any(|key| self.is_flawed(key)));
        for flaw in flaws {
            self.note_flaw(flaw, given);
        }
    }

    /// A flaw between two values is put down to the one that was given last.
    fn note_flaw(&mut self, flaw: Flaw, given: &DeValue<'_>) {
        let blame = |view: &View| {
            let trace = origin::trace(given, &view.key);
            let overridden = trace.position.is_some_and(|position| self.origins.setting(position).is_some());
            (trace.value.is_some(), overridden)
        };
        // Of equals `max_by_key` takes the last, and the first view is the one preferred.
        if let Some(view) = flaw.views.into_iter().rev().max_by_key(blame) {
            self.note(origin::trace(given, &view.key).position, Some(view.key), view.message);
        }
    }

    fn is_flawed(&self, key: &str) -> bool {
        let leads_to = |flawed: &String| {
            key.strip_prefix(flawed.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.flawed.iter().any(leads_to)
    }
}

fn position(error: &Error) -> Option<usize> {
    error.span().map(|span| span.start)
}

/// What is wrong with a text that is not TOML, in the words of this format where the parser's would mislead.
fn syntax_message(text: &str, position: usize, reason: &str) -> String {
    let before = text.get(..position).unwrap_or(text);
    let line = before.rfind('\n').map_or(0, |newline| newline + 1);
    let after_equals = before[line..].split_once('=').map(|(key, _)| line + key.len() + 1);
    let value = after_equals.map_or("", |start| text[start..].trim_start_matches([' ', '\t']));
    match value.chars().next() {
        Some(first) if first.is_ascii_digit() || "+-.".contains(first) => {
            "this is no value: write a number with a point and without a unit, such as 90.0".into()
        }
        Some(first) if first.is_alphabetic() => "this is no value: write text in quotes".into(),
        _ => format!("this is not TOML: {reason}"),
    }
}

/// What is wrong with a value of the right type that the deserializer refuses.
fn refusal(reason: &str, given: Option<&DeValue<'_>>, key: &str, wanted: &DeValue<'_>) -> String {
    match (given, reason.rsplit_once("expected ")) {
        (Some(DeValue::String(text)), Some((_, choices))) => {
            format!("{} is not known: give {}", shape::quote(text), choices.replace('`', "\""))
        }
        (Some(DeValue::Integer(number)), _) => {
            format!("{number} is out of range: {}", example::remedy(key, wanted))
        }
        _ => format!("{reason}: {}", example::remedy(key, wanted)),
    }
}

/// A sentence says by itself what is wrong with it.
fn is_sentence(key: &str) -> bool {
    key.starts_with("faults.") && example::last(key) == "do"
}

fn list_is_as_long_as_said(tree: &DeValue<'_>) -> bool {
    let at = |key| origin::trace(tree, key).value;
    let listed = at("start.uavs").and_then(DeValue::as_array).map(|list| list.len());
    let said =
        at("formation.uavs").and_then(DeValue::as_integer).and_then(|number| number.as_str().parse().ok());
    listed.is_none() || said.is_none() || listed == said
}

fn drop_list(tree: &mut DeValue<'_>) {
    let DeValue::Table(root) = tree else { return };
    if let Some(DeValue::Table(start)) = root.get_mut("start").map(Spanned::get_mut) {
        start.remove("uavs");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Law, Requirements, preset};
    use proptest::{prelude::*, sample::Index};

    fn read(text: &str, settings: &[&str]) -> Result<Scenario, ScenarioError> {
        let settings: Vec<_> = settings.iter().map(|text| Setting::parse(text).unwrap()).collect();
        Scenario::read(&Source { name: "wind.toml".into(), text: text.into() }, &settings)
    }

    fn problems(text: &str, settings: &[&str]) -> String {
        read(text, settings).unwrap_err().to_string()
    }

    const PRESET: &str = include_str!("../presets/paper-4.2.toml");

    #[test]
    fn all_that_is_wrong_is_said_at_once() {
        let text = r#"
name = "a/b"
colour = "red"
[time]
duration_s = "90 s"
rate_hz = 99.5
[formation]
uavs = 2
[control]
law = "tenacious"
dead_reckoning = "half"
[airframe]
speed_max_m_s = 10
speed_min_km_h = 43
[leader]
start_m = [0, nan]
[[obstacles]]
name = "mast"
position_m = [900.0, 42.0]
radius_m = 10
[[obstacles]]
name = "tower"
position_m = [500.0, 42.0]
radius_m = 30
braking_distance_m = 20
"#;
        let settings = ["speed_m_s=-3", "time.real_tiem=true", "replacements=-1", "obstacles.4.radius_m=1"];
        assert_eq!(
            problems(text, &settings),
            r#"
scenario "wind.toml", line 2: name: has other characters than letters, digits, "-", "_" and ".": give a name for a folder, such as "paper-4.2"
scenario "wind.toml", line 3: colour: no such key; known here are airframe, control, description, faults, formation, georeference, ipc, leader, membership, name, obstacles, requirements, seed, sensing, start, supervision, time
scenario "wind.toml", line 5: time.duration_s: "90 s" is text: give a number of seconds without a unit, such as 90.0
scenario "wind.toml", line 6: time.rate_hz: 99.5 is no whole number: give a whole number of hertz, such as 100
scenario "wind.toml", line 8: formation.uavs: 2 is not within 3 to 1024: give one that is
scenario "wind.toml", line 10: control.law: "tenacious" is not known: give "paper" or "resilient"
scenario "wind.toml", line 11: control.dead_reckoning: "half" is not known: give one of "off", "tick", "full"
scenario "wind.toml", line 13: airframe.speed_max_m_s: 10 m/s is not above speed_min_m_s 12 m/s: give a larger one
scenario "wind.toml", line 14: airframe.speed_min_km_h: no such key; did you mean speed_min_m_s, in m/s?
scenario "wind.toml", line 16: leader.start_m: NaN is not finite: give two numbers of metres, such as [900.0, 42.0]
scenario "wind.toml", line 17: obstacles.0.braking_distance_m: is missing: give a number of metres without a unit, such as 20.0
scenario "wind.toml", line 25: obstacles.1.braking_distance_m: 20 m is not above radius_m 30 m: give a larger one
--set speed_m_s=-3: leader.speed_m_s: -3 m/s is below airframe.speed_min_m_s 12 m/s: give a larger one
--set time.real_tiem=true: time.real_tiem: no such key; did you mean real_time?
--set replacements=-1: supervision.replacements: -1 is out of range: give a whole number, such as 10
--set obstacles.4.radius_m=1: obstacles.4.radius_m: there is no 4 in a list of 2; the first is 0
"#
            .trim()
        );
    }

    #[test]
    fn an_empty_file_is_the_default_scenario() {
        assert_eq!(read("", &[]).unwrap(), Scenario::default());
        assert_eq!(read("\u{feff}formation.spacing_m = 40\r\n", &[]).unwrap(), Scenario::default());
    }

    #[test]
    fn overrides_take_the_place_of_what_the_file_says() {
        let settings = ["speed_max_m_s=27", "control.law=paper", "obstacles.1.name=mast", "seed=3", "seed=4"];
        let scenario = read(PRESET, &settings).unwrap();
        assert_eq!(scenario.airframe.speed_max_m_s.to_bits(), 27.0_f64.to_bits());
        assert_eq!(
            (scenario.control.law, scenario.obstacles[1].name.as_str(), scenario.seed),
            (Law::Paper, "mast", 4)
        );
        assert_eq!(read(PRESET, &["obstacles=[]"]).unwrap().obstacles, []);
        assert_eq!(read("", &["settling_max_s=20"]).unwrap().requirements.settling_max_s, Some(20.0));
        assert_eq!(read("", &["requirements={}"]).unwrap().requirements, Requirements::default());
    }

    #[test]
    fn the_law_sets_the_switches_that_are_not_set_themselves() {
        let control = |text: &str, settings: &[&str]| read(text, settings).unwrap().control;
        let on = |control: &crate::Control| {
            let full = control.dead_reckoning == crate::DeadReckoning::Full;
            [full, control.trust_fades, control.gain_fades, control.force_limited, control.ring_closes]
        };
        assert_eq!(on(&control("", &[])), [false; 5]);
        assert_eq!(on(&control("control.law = 'resilient'", &[])), [true; 5]);
        let three = control("control.law = 'resilient'\ncontrol.gain_fades = false", &[]);
        assert_eq!((on(&three), three.law), ([true, true, false, true, true], Law::Resilient));
        assert_eq!(on(&control("control.trust_fades = true", &[])), [false, true, false, false, false]);
        assert_eq!(
            on(&control("", &["law=resilient", "ring_closes=false"])),
            [true, true, true, true, false]
        );
    }

    #[test]
    fn another_law_leaves_the_files_switches_behind() {
        assert_eq!(
            read(PRESET, &["law=resilient"]).unwrap(),
            read("", &["law=resilient"])
                .map(|scenario| Scenario { control: scenario.control, ..read(PRESET, &[]).unwrap() })
                .unwrap()
        );
        let kept = read("control.law = 'resilient'\ncontrol.gain_fades = false", &["law=resilient"]).unwrap();
        assert!(!kept.control.gain_fades, "the law is the file's");
    }

    #[test]
    fn an_override_puts_a_mistake_in_the_file_right() {
        assert!(read("time.duration_s = '90 s'", &["duration_s=90"]).is_ok());
        assert!(read("time = 3", &["duration_s=90"]).is_err());
    }

    #[test]
    fn a_flaw_of_two_values_is_put_down_to_the_one_given_last() {
        assert_eq!(
            problems(PRESET, &["speed_min_m_s=15.5"]).lines().next().unwrap(),
            "--set speed_min_m_s=15.5: airframe.speed_min_m_s: 15.5 m/s is above leader.speed_m_s 15 m/s: give a smaller one"
        );
        assert_eq!(
            problems("\n[airframe]\nspeed_min_m_s = 15.5", &[]),
            "scenario \"wind.toml\", line 3: airframe.speed_min_m_s: 15.5 m/s is above leader.speed_m_s 15 m/s: give a smaller one"
        );
    }

    #[test]
    fn a_value_that_breaks_two_bounds_is_told_both() {
        assert_eq!(
            problems("airframe.speed_max_m_s = 10", &[]),
            r#"
scenario "wind.toml", line 1: airframe.speed_max_m_s: 10 m/s is below leader.speed_m_s 15 m/s: give a larger one
scenario "wind.toml", line 1: airframe.speed_max_m_s: 10 m/s is not above speed_min_m_s 12 m/s: give a larger one
"#
            .trim()
        );
    }

    #[test]
    fn another_number_of_uavs_leaves_the_list_of_starts_behind() {
        assert_eq!(read(PRESET, &["uavs=6"]).unwrap().start.uavs.len(), 6);
        assert_eq!(read(PRESET, &["uavs=200"]).unwrap().start.uavs, []);
        let said = PRESET.replace("uavs = 6 ", "uavs = 7 ");
        let line = 1 + said.lines().position(|line| line == "[[start.uavs]]").unwrap();
        assert_eq!(
            problems(&said, &[]),
            format!(
                "scenario \"wind.toml\", line {line}: start.uavs: 6 starts are listed, but formation.uavs is 7: list 7, \
                 or none to have them drawn"
            )
        );
        let one = "start.uavs=[{position_m=[0,0], heading_deg=0, speed_m_s=15}]";
        assert!(problems(PRESET, &["uavs=3", one]).starts_with("--set start.uavs="));
    }

    #[test]
    fn what_is_no_toml_is_said_line_by_line() {
        assert_eq!(
            problems("name = wind\n[time]\nduration_s = 90 s\nrate_hz = 100\nrate_hz = 50\n[oops\n", &[]),
            r#"
scenario "wind.toml", line 1: this is no value: write text in quotes
scenario "wind.toml", line 3: this is no value: write a number with a point and without a unit, such as 90.0
scenario "wind.toml", line 5: this is not TOML: duplicate key
scenario "wind.toml", line 6: this is not TOML: unclosed table, expected `]`
"#
            .trim()
        );
    }

    #[test]
    fn a_wrong_value_is_complained_of_once() {
        for text in [
            "start.uavs = 5",
            "start = 5",
            "formation.uavs = 'six'",
            "[[start.uavs]]\nposition_m = [1, 2]",
            "time.rate_hz = -1",
            "time.rate_hz = 5000000000",
            "airframe.speed_min_m_s = nan",
            "obstacles = 'none'",
        ] {
            let mut whole: toml::Table = PRESET.parse().unwrap();
            let broken: toml::Table = text.parse().unwrap();
            for (section, values) in broken {
                match (whole.get_mut(&section), values) {
                    (Some(toml::Value::Table(into)), toml::Value::Table(values)) => into.extend(values),
                    (_, values) => drop(whole.insert(section, values)),
                }
            }
            let count = problems(&whole.to_string(), &[]).lines().count();
            assert_eq!(count, if text.starts_with("[[") { 3 } else { 1 }, "{text}");
        }
    }

    #[test]
    fn the_largest_seed_is_kept() {
        let scenario = Scenario { seed: u64::MAX, ..Scenario::default() };
        assert_eq!(Scenario::resolved(&scenario.to_toml()).unwrap(), scenario);
    }

    #[test]
    fn a_problem_can_be_read_by_a_script() {
        let error = read("time.duration_s = 0", &[]).unwrap_err();
        let [problem] = error.problems() else { panic!("one problem") };
        assert_eq!((&problem.place, problem.key.as_deref()), (&Place::Line(1), Some("time.duration_s")));
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back_to_the_last_bit(
            spacing in 2.5..1e7_f64, gain in 1e-300..5e6_f64, bearing in -360.0..=360.0_f64,
            places in prop::collection::vec(prop::array::uniform2(-1e7..1e7_f64), 0..7),
            start in prop::array::uniform2(prop_oneof![Just(-0.0), Just(f64::MIN_POSITIVE / 3.0), -1e7..1e7_f64]),
            clearance in prop::option::of(0.0..1e3_f64), seed: u64, description in "[^\\p{Cc}]*",
        ) {
            let mut scenario = Scenario { description, seed, ..Scenario::default() };
            scenario.formation.spacing_m = spacing;
            scenario.formation.bearing_deg = bearing;
            scenario.control.formation_gain = gain;
            scenario.leader.start_m = start;
            scenario.requirements.clearance_min_m = clearance;
            let obstacle = |(index, position_m)| crate::Obstacle {
                name: format!("\"{index}\\"), position_m, radius_m: gain, braking_distance_m: gain * 1.5,
            };
            scenario.sensing.range_m = 1e7;
            scenario.obstacles = places.into_iter().enumerate().map(obstacle).collect();
            let read = Scenario::resolved(&scenario.to_toml()).unwrap();
            prop_assert_eq!(read.leader.start_m.map(f64::to_bits), start.map(f64::to_bits));
            prop_assert_eq!(read, scenario);
        }

        #[test]
        fn no_text_makes_it_panic(
            which: Index, changes in prop::collection::vec((any::<Index>(), any::<Option<u8>>(), 0_usize..20), 1..8),
        ) {
            let mut bytes = which.get(preset::all()).text.as_bytes().to_vec();
            for (place, byte, length) in changes {
                let start = place.index(bytes.len());
                let end = (start + length).min(bytes.len());
                bytes.splice(start..end, byte);
                bytes.push(b'\n');
            }
            let text = String::from_utf8_lossy(&bytes);
            if let Err(error) = read(&text, &["uavs=7", "obstacles.0.radius_m=3"]) {
                prop_assert!(!error.problems().is_empty());
                prop_assert_eq!(error.to_string().lines().count(), error.problems().len());
            }
        }

        #[test]
        fn no_override_makes_it_panic(key in "[a-z_.0-9]{0,12}|start.uavs|obstacles.0|time", value in ".{0,12}") {
            let _ = read(PRESET, &[&format!("x{key}={value}"), &format!("time.{key}={value}")]);
            let setting = Setting::of_flag("--flag", &key, value);
            let _ = Scenario::read(&Source::find("paper-4.2").unwrap(), &[setting]);
        }
    }
}
