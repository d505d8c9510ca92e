//! Reads a scenario from text and overrides, or reports every mistake at once.
//!
//! The text becomes a tree whose values know where they were written. Overrides are put into the tree. A value of the
//! wrong shape is reported and replaced by the example's, so that the deserializer and then `validate` can still
//! check the rest.
//!
//! Never stops at the first mistake, unless the text is not TOML.

mod example;
mod hint;
mod law_switches;
mod origin;
mod problem;
mod setting;
mod shape;
mod source;
mod syntax;
#[cfg(test)]
mod tests;
mod track_file;
mod tree;

pub use example::{keys, scenario as example_scenario};
pub use problem::{Place, Problem, ScenarioError};
pub use setting::Setting;
pub use source::Source;

use crate::{
    AgentSection, Fault, PathKind, Scenario, fault_check,
    validate::{self, Blame, Violation},
};
use origin::Origins;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::{
    Spanned,
    de::{DeTable, DeValue, Error, ValueDeserializer},
};
use track_file::TrackFile;
use tree::lookup;

type Tree<'a> = Spanned<DeValue<'a>>;

impl Scenario {
    /// Reads a scenario. `settings` replace values of the source; a later setting replaces an earlier one.
    ///
    /// Two settings also drop what the source derives from the value that they replace. When `formation.uavs` no
    /// longer matches the number of listed starts, `start.uavs` becomes empty and starts are drawn. When
    /// `control.law` changes, the source's switches of the law are dropped and the new law sets them.
    ///
    /// # Errors
    /// Every mistake in the source and in the settings, each with its place, its key and a remedy.
    pub fn read(source: &Source, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let mut reader = ScenarioReader::new(source, settings);
        let scenario = reader.read();
        reader.finish(scenario)
    }

    /// Reads what [`Scenario::to_toml`] wrote.
    ///
    /// # Errors
    /// As [`Scenario::read`]; the messages call the source `scenario.toml`.
    pub fn resolved(text: &str) -> Result<Self, ScenarioError> {
        Self::read(&Source { name: "scenario.toml".into(), text: text.into() }, &[])
    }

    /// Reads what [`Scenario::to_toml`] wrote of a valid scenario, without checking it again. Every process of a run does
    /// this when it starts: it takes 0.2 ms, and [`Scenario::resolved`] takes 0.5 ms.
    ///
    /// # Errors
    /// As [`Scenario::resolved`], if the text was changed so that it cannot be read.
    pub fn of_run(text: &str) -> Result<Self, ScenarioError> {
        toml::from_str(text).or_else(|_| Self::resolved(text))
    }

    /// Adds the faults of `--fault`, and loads the delay files that they name; relative paths count from the working
    /// folder.
    ///
    /// # Errors
    /// A fault is impossible in this swarm, or a delay file cannot be loaded.
    pub fn with_faults(mut self, faults: &[Fault]) -> Result<Self, ScenarioError> {
        let name = self.name.clone();
        let problem = |fault: &Fault, message| Problem {
            scenario: name.clone(),
            place: fault_flag(fault),
            key: None,
            message,
        };
        let mut problems = Vec::new();
        for fault in faults {
            let mut loaded = fault.clone();
            let refusal = self.refusal_of(fault).or_else(|| loaded.action.load_delays(Path::new("")).err());
            problems.extend(refusal.map(|message| problem(fault, message)));
            self.faults.push(loaded);
        }
        if problems.is_empty() { Ok(self) } else { Err(problems.into()) }
    }
}

/// Where a program of the command line was written.
fn agent_flag(agent: &AgentSection) -> Place {
    Place::Setting(format!("--agent \"{}\"", agent.flag()))
}

/// Where a fault of the command line was written.
fn fault_flag(fault: &Fault) -> Place {
    Place::Setting(format!("--fault \"{fault}\""))
}

/// A scenario with the places at which its faults were written, for warnings about them.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The scenario.
    pub scenario: Scenario,
    /// Its name in messages: the preset's name or the file's path.
    name: String,
    /// The place of each fault, in the scenario's order.
    fault_places: Vec<Place>,
}

impl Reading {
    /// Reads a scenario as [`Scenario::read`] does.
    ///
    /// # Errors
    /// As [`Scenario::read`].
    pub fn read(source: &Source, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let mut reader = ScenarioReader::new(source, settings);
        let scenario = reader.read();
        let fault_places = std::mem::take(&mut reader.fault_places);
        Ok(Self { scenario: reader.finish(scenario)?, name: source.name.clone(), fault_places })
    }

    /// Adds the faults of `--fault`.
    ///
    /// # Errors
    /// As [`Scenario::with_faults`].
    pub fn with_faults(mut self, faults: &[Fault]) -> Result<Self, ScenarioError> {
        self.scenario = self.scenario.with_faults(faults)?;
        self.fault_places.extend(faults.iter().map(fault_flag));
        Ok(self)
    }

    /// Adds the programs of `--agent`, which start in the working folder.
    ///
    /// # Errors
    /// A program is for a UAV that the swarm does not have, or the working folder cannot be used.
    pub fn with_agents(mut self, agents: &[AgentSection]) -> Result<Self, ScenarioError> {
        let mut problems = Vec::new();
        for agent in agents {
            let placed = agent.placed();
            let section = placed.clone().unwrap_or_else(|_| agent.clone());
            let alone = Scenario { agents: vec![section.clone()], ..self.scenario.clone() };
            let refusals = placed.err().into_iter().chain(validate::messages_about_agents(&alone));
            problems.extend(refusals.map(|message| Problem {
                scenario: self.name.clone(),
                place: agent_flag(agent),
                key: None,
                message,
            }));
            self.scenario.agents.push(section);
        }
        if problems.is_empty() { Ok(self) } else { Err(problems.into()) }
    }

    /// A warning about each fault that can have no effect, and about each delay that rounding changes noticeably.
    pub fn warnings(&self) -> Vec<Problem> {
        let place = |number: u32| {
            let place = self.fault_places.get(number as usize - 1).cloned();
            place.unwrap_or(Place::Scenario)
        };
        let problem = |(number, message): (u32, String)| Problem {
            scenario: self.name.clone(),
            place: place(number),
            key: None,
            message,
        };
        fault_check::warnings(&self.scenario).into_iter().map(problem).collect()
    }
}

/// A scenario that is being read, and its problems so far.
struct ScenarioReader<'s> {
    source: &'s Source,
    settings: &'s [Setting],
    origins: Origins<'s>,
    /// The problems with their positions, which order them.
    problems: Vec<(Option<usize>, Problem)>,
    /// Keys whose values are known to be wrong: a replacement stands in for each, so later checks must ignore them.
    wrong_keys: Vec<String>,
    /// Where each fault of the scenario was written.
    fault_places: Vec<Place>,
    /// The file that the points of the leader's track come from.
    track_file: Option<TrackFile>,
}

impl<'s> ScenarioReader<'s> {
    fn new(source: &'s Source, settings: &'s [Setting]) -> Self {
        let origins = Origins::new(&source.text, settings);
        Self {
            source,
            settings,
            origins,
            problems: Vec::new(),
            wrong_keys: Vec::new(),
            fault_places: Vec::new(),
            track_file: None,
        }
    }

    /// The scenario as far as it can be read; it is valid only if no problem was reported.
    fn read(&mut self) -> Option<Scenario> {
        let mut tree = self.parse()?;
        let law_of_file = law_switches::law(tree.get_ref());
        let keys_set = self.apply_settings(&mut tree);
        // Decide this now: `fit` may replace a wrong number of UAVs by the example's.
        let starts_apply = listed_starts_apply(tree.get_ref(), &keys_set);

        // The switches that a file sets belong to its law, so another law must not inherit them.
        let is_law_set = keys_set.iter().any(|key| key == law_switches::LAW);
        if is_law_set && law_switches::law(tree.get_ref()) != law_of_file {
            law_switches::remove_except(tree.get_mut(), &keys_set);
        }
        law_switches::fill_in(&mut tree);

        // Messages quote and locate the values as given, not those that replace them.
        let given = tree.clone();
        self.fit(&mut tree);
        if !starts_apply {
            remove_listed_starts(tree.get_mut());
        }
        let mut scenario = self.deserialize(tree, given.get_ref())?;
        self.read_delay_files(&mut scenario, given.get_ref());
        self.read_track_file(&mut scenario, given.get_ref());
        self.place_agents(&mut scenario, given.get_ref());
        self.validate(&scenario, given.get_ref());
        Some(scenario)
    }

    fn finish(mut self, scenario: Option<Scenario>) -> Result<Scenario, ScenarioError> {
        // Overrides have positions beyond the text, so they follow the file; problems without a position come first.
        self.problems.sort_by_key(|(position, _)| *position);
        let problems: Vec<_> = self.problems.into_iter().map(|(_, problem)| problem).collect();
        match scenario {
            Some(scenario) if problems.is_empty() => Ok(scenario),
            _ => Err(problems.into()),
        }
    }

    fn report(&mut self, position: Option<usize>, key: Option<String>, message: String) {
        let place = position.map_or(Place::Scenario, |position| self.origins.place(position));
        self.wrong_keys.extend(key.clone());
        self.problems.push((position, Problem { scenario: self.source.name.clone(), place, key, message }));
    }

    /// The text as a tree, if it is TOML.
    fn parse(&mut self) -> Option<Tree<'s>> {
        let (table, mut errors) = DeTable::parse_recoverable(&self.source.text);
        errors.sort_by_key(position);
        for error in &errors {
            self.report_syntax_error(error);
        }
        errors.is_empty().then(|| Spanned::new(0..0, DeValue::Table(table.into_inner())))
    }

    /// Reports the first error of each line: the parser's further errors there follow from it.
    fn report_syntax_error(&mut self, error: &Error) {
        let position = position(error).unwrap_or(self.source.text.len());
        let place = self.origins.place(position);
        if self.problems.last().is_none_or(|(_, last)| last.place != place) {
            let message = syntax::syntax_error(&self.source.text, position, error.message());
            self.report(Some(position), None, message);
        }
    }

    /// Puts the overrides into the tree, and returns the keys that they set.
    fn apply_settings(&mut self, tree: &mut Tree<'s>) -> Vec<String> {
        let mut keys = Vec::new();
        for (index, setting) in self.settings.iter().enumerate() {
            match self.apply(index, setting, tree) {
                Ok(key) => keys.push(key),
                Err(message) => {
                    // This override has put no value into the tree, so it needs a position of its own.
                    let position = self.origins.new_span(index).start;
                    self.report(Some(position), Some(setting.key.clone()), message);
                }
            }
        }
        keys
    }

    fn apply(&mut self, index: usize, setting: &'s Setting, tree: &mut Tree<'s>) -> Result<String, String> {
        let key = hint::full_key(&setting.key)?;
        let value = shape::value_of(&setting.value, example::at(&key));
        tree::put(tree, &key, self.origins.with_spans(value, index))?;
        Ok(key)
    }

    fn fit(&mut self, tree: &mut Tree<'s>) {
        let mut mismatches = Vec::new();
        shape::fit(tree, example::tree(), "", &mut mismatches);
        for mismatch in mismatches {
            self.report(Some(mismatch.position), Some(mismatch.key), mismatch.message);
        }
    }

    /// Deserializes the tree.
    ///
    /// The deserializer stops at the first value that it refuses. Report that value, replace it by the example's and
    /// try again, until there are no more.
    fn deserialize(&mut self, mut tree: Tree<'s>, given: &DeValue<'_>) -> Option<Scenario> {
        loop {
            let error = match Scenario::deserialize(ValueDeserializer::from(tree.clone())) {
                Ok(scenario) => return Some(scenario),
                Err(error) => error,
            };
            let key = error.span().and_then(|span| tree::key_at(given, &span));
            let known = key.filter(|key| !self.is_wrong(key)).and_then(|key| Some((example::at(&key)?, key)));
            // Without a key there is nothing to replace, and the next try would fail in the same way.
            let Some((wanted, key)) = known else {
                self.report(position(&error), None, error.message().into());
                return None;
            };
            let message = syntax::refused_value(error.message(), lookup(given, &key).value, &key, wanted);
            self.report(position(&error), Some(key.clone()), message);
            tree::put(&mut tree, &key, Spanned::new(0..0, wanted.clone())).ok()?;
        }
    }

    /// Replaces the delay files that faults name by their content, and notes where each fault was written.
    fn read_delay_files(&mut self, scenario: &mut Scenario, given: &DeValue<'_>) {
        for (index, fault) in scenario.faults.iter_mut().enumerate() {
            let key = format!("faults.{index}.do");
            let position = lookup(given, &key).position;
            let place = position.map_or(Place::Scenario, |position| self.origins.place(position));
            let folder = self.folder_at(&place);
            self.fault_places.push(place);
            if let Err(message) = fault.action.load_delays(&folder) {
                self.report(position, Some(key), message);
            }
        }
    }

    /// Replaces the file of the leader's track by its points.
    fn read_track_file(&mut self, scenario: &mut Scenario, given: &DeValue<'_>) {
        const KEY: &str = "leader.path.file";
        let path = &mut scenario.leader.path;
        if path.kind != PathKind::Track || path.file.is_empty() {
            return;
        }
        let position = lookup(given, KEY).position;
        let place = position.map_or(Place::Scenario, |position| self.origins.place(position));
        let read = if path.points.is_empty() {
            TrackFile::read(&self.folder_at(&place).join(&path.file))
        } else {
            Err("there is a file and a list of points: give one of the two".into())
        };
        match read {
            Ok(file) => {
                path.points.clone_from(&file.points);
                path.file.clear();
                self.track_file = Some(file);
            }
            Err(message) => self.report(position, Some(KEY.into()), message),
        }
    }

    /// Makes the folder of each program of the user's absolute, so that it means the same in the run's log.
    fn place_agents(&mut self, scenario: &mut Scenario, given: &DeValue<'_>) {
        for (index, section) in scenario.agents.iter_mut().enumerate() {
            let position = lookup(given, &format!("agents.{index}.folder")).position;
            let place = position.map_or(Place::Scenario, |position| self.origins.place(position));
            let folder = self.folder_at(&place).join(&section.folder);
            match absolute(&folder) {
                Ok(folder) => section.folder = folder,
                Err(message) => self.report(position, Some(format!("agents.{index}.folder")), message),
            }
        }
    }

    /// The folder from which a path counts that was written at `place`: in a file from the folder of that file, and in an
    /// override from the working folder, as in any other argument.
    fn folder_at(&self, place: &Place) -> PathBuf {
        if matches!(place, Place::Setting(_)) { PathBuf::new() } else { self.source.folder() }
    }

    fn validate(&mut self, scenario: &Scenario, given: &DeValue<'_>) {
        let mut violations = validate::violations(scenario);
        // A stand-in may violate bounds that the user's own value would keep.
        violations.retain(|violation| !violation.keys().any(|key| self.is_wrong(key)));
        for violation in violations {
            self.report_violation(violation, given);
        }
    }

    /// Reports a violation at the key that the user set last among its keys: in an override, else in the file.
    fn report_violation(&mut self, violation: Violation, given: &DeValue<'_>) {
        // Blame a default only if the user gave none of the values.
        let rank = |key: &str| {
            let found = lookup(given, key);
            let in_override = found.position.is_some_and(|position| self.origins.setting(position).is_some());
            (found.value.is_some(), in_override)
        };
        // `max_by_key` takes the last of equals, and the first is the preferred one.
        if let Some(blame) = violation.blames.into_iter().rev().max_by_key(|blame| rank(&blame.key)) {
            let (key, message) = self.in_track_file(blame);
            self.report(lookup(given, &key).position, Some(key), message);
        }
    }

    /// The key and the message of `blame`. A point that comes from a file is blamed at its line there.
    fn in_track_file(&self, Blame { key, message }: Blame) -> (String, String) {
        let rest = key.strip_prefix("leader.path.points");
        let Some((file, rest)) = self.track_file.as_ref().zip(rest) else { return (key, message) };
        let index = rest.trim_start_matches('.').split('.').next().and_then(|index| index.parse().ok());
        ("leader.path.file".into(), format!("{}: {message}", file.line(index.unwrap_or(usize::MAX))))
    }

    /// Whether `key` or a section around it has been reported.
    fn is_wrong(&self, key: &str) -> bool {
        let includes = |wrong: &String| {
            // The dot tells a section from a longer name that begins in the same way.
            key.strip_prefix(wrong.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.wrong_keys.iter().any(includes)
    }
}

fn position(error: &Error) -> Option<usize> {
    error.span().map(|span| span.start)
}

impl AgentSection {
    /// The section with the absolute path of its folder; a relative one counts from the working folder.
    ///
    /// # Errors
    /// The working folder cannot be used, or a path is not UTF-8.
    pub fn placed(&self) -> Result<Self, String> {
        Ok(Self { folder: absolute(Path::new(&self.folder))?, ..self.clone() })
    }
}

/// `folder` as an absolute path, from the working folder.
fn absolute(folder: &Path) -> Result<String, String> {
    // The empty path is the working folder, and has no absolute form of its own. Collecting drops a slash at the end.
    let folder: PathBuf = Path::new(".").join(folder).components().collect();
    let unusable =
        |why: &dyn std::fmt::Display| format!("folder {}: cannot be used: {why}", folder.display());
    let absolute = std::path::absolute(&folder).map_err(|why| unusable(&why))?;
    absolute.to_str().map(str::to_owned).ok_or_else(|| unusable(&"its path is not UTF-8"))
}

/// Whether the listed starts still apply after the settings of `keys_set`.
///
/// A user who only asks for another number of UAVs does not want to list their starts.
fn listed_starts_apply(tree: &DeValue<'_>, keys_set: &[String]) -> bool {
    let are_starts_set = keys_set.iter().any(|key| key.starts_with("start.uavs"));
    let is_count_set = keys_set.iter().any(|key| key == "formation.uavs");
    are_starts_set || !is_count_set || starts_match_uavs(tree)
}

fn starts_match_uavs(tree: &DeValue<'_>) -> bool {
    let listed = lookup(tree, "start.uavs").value.and_then(DeValue::as_array).map(|list| list.len());
    let uavs = lookup(tree, "formation.uavs").value.and_then(DeValue::as_integer);
    let uavs = uavs.and_then(|number| number.as_str().parse().ok());
    listed.is_none() || uavs.is_none() || listed == uavs
}

fn remove_listed_starts(tree: &mut DeValue<'_>) {
    let DeValue::Table(root) = tree else { return };
    if let Some(DeValue::Table(start)) = root.get_mut("start").map(Spanned::get_mut) {
        start.remove("uavs");
    }
}
