//! Flies a sweep in this process, and hands its rows to Python as columns.
//!
//! Never keeps a result on disk: `ringwing sweep` writes folders that go on after a kill, with maps and a page.

use crate::{
    columns::{Column, TextColumn},
    error::Failure,
    interrupt::SignalWatch,
};
use pyo3::prelude::*;
use ringwing_scenario::{AgentSection, Scenario};
use ringwing_study::{
    Figure,
    figure::FIGURES,
    fly,
    statistics::Share,
    sweep::{
        Cell, Columns as RowColumns, Combination, Crew, Definition, Draft, Given, Ledger, Row, RowFile,
        Sampling, Shard, Tally, Text, check, read_cells, read_rows, run as fly_all,
    },
};
use std::{
    num::NonZero,
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
};

/// Columns by name.
type Named = Vec<(String, Column)>;
/// Columns by name, as Python gets them.
type PythonColumns = Vec<(String, Py<PyAny>)>;

/// What a caller asks for besides scenario, axes and faults. `_native.pyi` describes each.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    combination: Option<String>,
    sampling: Option<String>,
    samples: Option<u64>,
    seeds: Option<u64>,
    first_seed: Option<u64>,
    precision: Option<f64>,
    seeds_max: Option<u64>,
    jobs: Option<NonZero<usize>>,
    figures: Vec<String>,
    /// The UAVs as `--agent` names them, and the program with its arguments.
    agents: Vec<(String, Vec<String>)>,
}

/// The values of an axis: one text that may hold ranges, or a list of values.
#[derive(FromPyObject)]
pub(crate) enum AxisValues {
    One(String),
    List(Vec<String>),
}

impl From<AxisValues> for Text {
    fn from(values: AxisValues) -> Self {
        match values {
            AxisValues::One(text) => Self::One(text),
            AxisValues::List(items) => Self::List(items),
        }
    }
}

/// Flies the sweep that `base` begins. Returns the columns of its flights and of its cells. `progress` is called when flights have
/// landed, with their number and the most that there will be.
#[pyfunction]
pub(crate) fn sweep(
    py: Python<'_>,
    base: String,
    axes: Vec<(String, AxisValues)>,
    set: Vec<(String, String)>,
    faults: Vec<String>,
    options: Options,
    progress: Option<Py<PyAny>>,
) -> PyResult<(PythonColumns, PythonColumns)> {
    let draft = draft(&base, axes, set, &faults, &options).map_err(PyErr::from)?;
    // Release the interpreter's lock: signals and `progress` take it only while they run.
    let (rows, cells) = py.detach(|| fly_sweep(draft, &options, progress.as_ref()))?;
    Ok((into_python(py, rows)?, into_python(py, cells)?))
}

fn into_python(py: Python<'_>, columns: Named) -> PyResult<PythonColumns> {
    columns.into_iter().map(|(name, column)| Ok((name, column.into_python(py)?))).collect()
}

fn draft(
    base: &str,
    axes: Vec<(String, AxisValues)>,
    set: Vec<(String, String)>,
    faults: &[String],
    options: &Options,
) -> Result<Draft, Failure> {
    let mut draft = Draft::named(base)?;
    for (name, values) in axes {
        let place = format!("axes[{name:?}]");
        draft.add_axis(Given { name, text: values.into(), place });
    }
    for (key, value) in set {
        draft.set(Given::new(&key, &value, &format!("set[{key:?}]")));
    }
    draft.faults.extend(faults.iter().map(|sentence| Given::new("", sentence, "faults")));
    let placed = |(uavs, command): &(String, Vec<String>)| {
        AgentSection { uavs: uavs.clone(), command: command.clone(), folder: String::new() }.placed()
    };
    draft.agents = options.agents.iter().map(placed).collect::<Result<_, _>>().map_err(Failure::Wrong)?;
    draft.combination = options.combination.as_deref().map(combination).transpose()?.or(draft.combination);
    draft.sampling = options.sampling.as_deref().map(sampling).transpose()?.or(draft.sampling);
    draft.samples = options.samples.or(draft.samples);
    draft.seeds = options.seeds.or(draft.seeds);
    draft.first_seed = options.first_seed.or(draft.first_seed);
    draft.precision = options.precision.or(draft.precision);
    draft.seeds_max = options.seeds_max.or(draft.seeds_max);
    Ok(draft)
}

fn combination(name: &str) -> Result<Combination, Failure> {
    match name {
        "grid" => Ok(Combination::Grid),
        "zip" => Ok(Combination::Zip),
        "one-at-a-time" => Ok(Combination::OneAtATime),
        other => Err(Failure::Wrong(format!("combination {other:?}: give grid, zip or one-at-a-time"))),
    }
}

fn sampling(name: &str) -> Result<Sampling, Failure> {
    match name {
        "independent" => Ok(Sampling::Independent),
        "latin-hypercube" => Ok(Sampling::LatinHypercube),
        other => Err(Failure::Wrong(format!("sampling {other:?}: give independent or latin-hypercube"))),
    }
}

fn figure(name: &str) -> Result<&'static Figure, Failure> {
    Figure::named(name).ok_or_else(|| {
        let names: Vec<_> = FIGURES.iter().map(|figure| figure.name).collect();
        Failure::Wrong(format!("figure {name:?}: the figures are {}", names.join(", ")))
    })
}

fn fly_sweep(
    draft: Draft,
    options: &Options,
    progress: Option<&Py<PyAny>>,
) -> Result<(Named, Named), Failure> {
    let figures = options.figures.iter().map(|name| figure(name)).collect::<Result<Vec<_>, _>>()?;
    let sweep = draft.finish()?;
    let too_many = || Failure::Wrong("more flights than can be counted: give fewer values or seeds".into());
    let (cells, flights) = sweep.cells().zip(sweep.flights()).ok_or_else(too_many)?;
    let columns = RowColumns::of(&sweep);
    if let Some(axis) = columns.ambiguous() {
        return Err(Failure::Wrong(format!(
            "axes[{axis:?}]: a column of the results has this name: give another one"
        )));
    }
    let jobs =
        options.jobs.map_or_else(|| thread::available_parallelism().map_or(1, NonZero::get), NonZero::get);
    let watch = Watch::new(flights, progress);
    let problems = check(&sweep, jobs, true, || watch.stops());
    if !problems.is_empty() {
        return Err(Failure::Wrong(problems.join("\n")));
    }
    let folder = tempfile::tempdir().map_err(|error| Failure::unwritable(&std::env::temp_dir(), error))?;
    let path = folder.path().join("flights.csv");
    let rows = RowFile::open(&path, columns, |_| {})?;
    let ledger = Ledger::new(cells, &sweep.seeds, Shard::WHOLE);
    let simulate = |scenario: &Scenario| fly(scenario).map_err(|error| error.to_string());
    let crew = Crew { jobs, fly: simulate, stops: || watch.stops() };
    let (rows, _) = fly_all(&sweep, ledger, rows, &crew, |tally| watch.look(tally))?;
    // Threads land in any order, but cells are put together from rows sorted by cell.
    rows.sort()?;
    watch.finish()?;
    Ok((row_columns(&path, &sweep)?, cell_columns(&path, &sweep, &figures)?))
}

/// Looks for signals and shows progress while others fly.
struct Watch<'a> {
    progress: Option<&'a Py<PyAny>>,
    /// The most flights that there will be.
    flights: u64,
    signals: Mutex<SignalWatch>,
    /// What a signal handler or `progress` has raised.
    raised: Mutex<Option<PyErr>>,
    stops: AtomicBool,
}

impl<'a> Watch<'a> {
    fn new(flights: u64, progress: Option<&'a Py<PyAny>>) -> Self {
        Self {
            progress,
            flights,
            signals: Mutex::new(SignalWatch::new()),
            raised: Mutex::new(None),
            stops: AtomicBool::new(false),
        }
    }

    fn stops(&self) -> bool {
        self.stops.load(Relaxed)
    }

    fn look(&self, tally: Tally) {
        let mut signals = self.signals.lock().unwrap_or_else(PoisonError::into_inner);
        let error = signals.raised().or_else(|| self.show(tally));
        if let Some(error) = error {
            self.stops.store(true, Relaxed);
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }

    /// Calls `progress`; returns the exception that it raises.
    fn show(&self, tally: Tally) -> Option<PyErr> {
        // After an exception, `progress` stays uncalled while the flights in the air land.
        let progress = self.progress.filter(|_| !self.stops())?;
        Python::attach(|py| progress.call1(py, (tally.flown, self.flights)).err())
    }

    fn finish(self) -> Result<(), PyErr> {
        self.raised.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }
}

fn floats(values: impl Iterator<Item = Option<f64>>) -> Column {
    Column::Float(values.map(|value| value.unwrap_or(f64::NAN)).collect())
}

fn counts(values: impl Iterator<Item = u64>) -> Column {
    // Cells, seeds and flights of a sweep are below 2^63.
    Column::Int(values.map(u64::cast_signed).collect())
}

fn texts<'a>(values: impl Iterator<Item = &'a str>) -> Column {
    let mut column = TextColumn::default();
    values.for_each(|text| column.push(text.to_owned()));
    Column::Text(column)
}

fn row_columns(path: &Path, sweep: &Definition) -> Result<Named, Failure> {
    let columns = RowColumns::of(sweep);
    let mut rows: Vec<Row> = Vec::new();
    read_rows(path, &columns, |row| rows.push(row.clone()))?;
    let mut named = vec![
        ("cell".to_owned(), counts(rows.iter().map(|row| row.cell))),
        ("seed".to_owned(), counts(rows.iter().map(|row| row.seed))),
    ];
    for (place, axis) in columns.axes.iter().enumerate() {
        named.push((axis.clone(), texts(rows.iter().map(|row| row.values[place].as_str()))));
    }
    let violated: Vec<String> = rows.iter().map(|row| row.violated.join(" ")).collect();
    named.push(("verdict".to_owned(), texts(rows.iter().map(|row| row.verdict.name()))));
    named.push(("violated".to_owned(), texts(violated.iter().map(String::as_str))));
    for (place, figure) in FIGURES.iter().enumerate() {
        named.push((figure.name.to_owned(), floats(rows.iter().map(|row| row.figures[place]))));
    }
    let hashes = rows.iter().map(|row| row.payload_hash.as_deref().unwrap_or_default());
    named.push(("payload_hash".to_owned(), texts(hashes)));
    let failures = rows.iter().map(|row| row.failure.as_deref().unwrap_or_default());
    named.push(("failure".to_owned(), texts(failures)));
    Ok(named)
}

fn cell_columns(path: &Path, sweep: &Definition, figures: &[&Figure]) -> Result<Named, Failure> {
    let cells: Vec<Cell> = read_cells(path, sweep, figures)?;
    let mut named = vec![("cell".to_owned(), counts(cells.iter().map(|cell| cell.cell)))];
    for (place, axis) in RowColumns::of(sweep).axes.iter().enumerate() {
        named.push((axis.clone(), texts(cells.iter().map(|cell| cell.values[place].as_str()))));
    }
    named.push(("flights".to_owned(), counts(cells.iter().map(|cell| cell.flights))));
    named.push(("passed".to_owned(), counts(cells.iter().map(|cell| cell.passed))));
    let share = |get: fn(Share) -> f64| floats(cells.iter().map(|cell| Some(get(cell.success()))));
    named.push(("success".to_owned(), share(|share| share.value)));
    named.push(("success_low".to_owned(), share(|share| share.low)));
    named.push(("success_high".to_owned(), share(|share| share.high)));
    for (place, figure) in figures.iter().enumerate() {
        let median = floats(cells.iter().map(|cell| cell.figures[place].median));
        named.push((format!("{}_median", figure.name), median));
        named
            .push((format!("{}_bad", figure.name), floats(cells.iter().map(|cell| cell.figures[place].bad))));
    }
    Ok(named)
}
