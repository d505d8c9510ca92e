//! A log as Python sees it: what flew, how it went, and its topics as columns.
//!
//! Never reads a log in another way than `ringwing review`, so that both say the same of a damaged one.

use crate::{error::Failure, notes, tables};
use pyo3::prelude::*;
use ringwing_recorder::log::{
    meter::Measured,
    reader::{Reader, Shortfalls},
    run_folder::named,
};
use ringwing_scenario::Scenario;
use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

/// Topics with their columns: the name and the values of each.
type Tables = BTreeMap<String, Vec<(String, Py<PyAny>)>>;
type Metadata = BTreeMap<String, String>;

/// An open log.
#[pyclass(frozen, module = "ringwing._native")]
pub(crate) struct NativeLog {
    scenario: Scenario,
    shortfalls: Shortfalls,
    /// `None` only while a call reads.
    reader: Mutex<Option<Reader>>,
    run: Metadata,
    result: Metadata,
    topics: Vec<String>,
    path: PathBuf,
}

impl NativeLog {
    fn read(path: PathBuf) -> Result<Self, Failure> {
        let reader = Reader::open(&named(&path))?;
        let scenario = reader.scenario()?;
        Ok(Self {
            shortfalls: reader.shortfalls(&scenario),
            run: reader.run().cloned().unwrap_or_default(),
            result: reader.result().cloned().unwrap_or_default(),
            topics: reader.topics().map(ToOwned::to_owned).collect(),
            path: reader.path().to_owned(),
            scenario,
            reader: Mutex::new(Some(reader)),
        })
    }

    /// Hands the reader, before its first message, to `read`.
    fn with_reader<T>(&self, read: impl FnOnce(&mut Reader) -> T) -> T {
        let mut place = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        // `rewind` takes the reader; a panic while it reads would lose it, and every later call says so.
        let mut reader = place.take().expect("a call before this one panicked").rewind();
        let value = read(&mut reader);
        *place = Some(reader);
        value
    }
}

#[pymethods]
impl NativeLog {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Ok(py.detach(|| Self::read(path))?)
    }

    /// The file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Number of UAVs.
    #[getter]
    fn uavs(&self) -> u32 {
        self.scenario.formation.uavs
    }

    /// Ticks a second.
    #[getter]
    fn rate_hz(&self) -> u32 {
        self.scenario.time.rate_hz
    }

    /// The scenario as JSON.
    fn scenario(&self) -> PyResult<String> {
        serde_json::to_string(&self.scenario).map_err(|error| Failure::Wrong(error.to_string()).into())
    }

    /// The metadata `run` and `result`.
    fn metadata(&self) -> (Metadata, Metadata) {
        (self.run.clone(), self.result.clone())
    }

    /// The topics that have messages.
    fn topics(&self) -> Vec<String> {
        self.topics.clone()
    }

    /// What the log lacks of its flight, and what is unusual about it.
    fn shortfalls(&self) -> (Vec<String>, Vec<String>) {
        (self.shortfalls.problems.clone(), self.shortfalls.notes.clone())
    }

    /// The summary as JSON, as `ringwing review --json` prints it.
    fn summary(&self, py: Python<'_>) -> String {
        py.detach(|| self.with_reader(|reader| Measured::of(reader, &self.scenario).summary.to_json()))
    }

    /// The columns of all topics that begin with `before` and end with `after`.
    fn tables(&self, py: Python<'_>, before: &str, after: &str) -> PyResult<Tables> {
        let wanted = |topic: &str| topic.starts_with(before) && topic.ends_with(after);
        let tables = py.detach(|| self.with_reader(|reader| tables::read(reader, wanted)));
        tables.into_iter().map(|(topic, columns)| Ok((topic, columns.into_python(py)?))).collect()
    }

    /// The columns of the notes of each UAV that has any, by topic.
    fn notes(&self, py: Python<'_>) -> Tables {
        let notes = py.detach(|| self.with_reader(notes::read));
        notes.into_iter().map(|(topic, columns)| (topic, columns.into_python(py))).collect()
    }
}
