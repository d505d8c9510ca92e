//! The results of a sweep in files: `flights.csv` while it runs and afterwards, and the definition beside it.
//!
//! A row is appended as soon as its flight has landed, so a killed sweep loses only the flights in the air. At the end the
//! rows are sorted. Never keeps rows in memory: only where each one is in the file.

use super::{
    cells::{Cell, CellFold},
    definition::{Definition, Manifest},
    ledger::FlightId,
    row::{Columns, Row},
    shard::Shard,
};
use crate::{
    figure::Figure,
    files::{LineFile, ResultsError, damaged, fields_of, line_of, replace, scan_lines},
};
use std::{
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
};

/// The definition's file in the folder of a sweep.
pub const DEFINITION: &str = "sweep.json";

impl Manifest {
    /// Reads the manifest of the sweep in `folder`; `None` if the folder has no manifest.
    ///
    /// # Errors
    /// The file cannot be read, or is not a manifest of this version.
    pub fn read(folder: &Path) -> Result<Option<Self>, ResultsError> {
        let path = folder.join(DEFINITION);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(ResultsError::file(&path, "read")(error)),
        };
        let manifest = serde_json::from_str(&text).map_err(|error| {
            ResultsError::other(
                &path,
                format!("this is not the definition of a sweep of this version: {error}"),
            )
        })?;
        Ok(Some(manifest))
    }

    /// As [`Self::read`], where a sweep is expected.
    ///
    /// # Errors
    /// As [`Self::read`], or there is no sweep.
    pub fn expect(folder: &Path) -> Result<Self, ResultsError> {
        Self::read(folder)?.ok_or_else(|| {
            ResultsError::other(
                folder,
                format!("there is no {DEFINITION} here: give the folder of a sweep's results"),
            )
        })
    }

    /// Writes the manifest into `folder`, whole or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ResultsError> {
        let path = folder.join(DEFINITION);
        replace(&path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })
    }
}

/// The name of the rows' file of a shard.
pub fn flights_file(shard: Shard) -> String {
    if shard == Shard::WHOLE {
        "flights.csv".into()
    } else {
        format!("flights.{:04}-of-{:04}.csv", shard.number, shard.count)
    }
}

/// Where a row is in its file.
#[derive(Debug, Clone, Copy)]
struct RowPlace {
    cell: u64,
    seed: u64,
    offset: u64,
    bytes: u32,
}

/// The file of rows, open for appending.
pub struct RowFile {
    columns: Columns,
    lines: LineFile,
    rows: u64,
}

impl RowFile {
    /// Opens the rows at `path`, or begins them, and tells `each` what is there. A torn last row is cut off.
    ///
    /// # Errors
    /// Another process writes the file, it has other columns, or it cannot be read or written.
    pub fn open(path: &Path, columns: Columns, mut each: impl FnMut(&Row)) -> Result<Self, ResultsError> {
        let mut rows = 0;
        let lines = LineFile::open(path, &header(&columns), |line, offset| {
            rows += 1;
            each(&parse_line(line, &columns).ok_or_else(|| damaged(path, offset))?);
            Ok(())
        })?;
        Ok(Self { columns, lines, rows })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// The disk is full, for example.
    pub fn append(&mut self, row: &Row) -> Result<(), ResultsError> {
        self.rows += 1;
        self.lines.append(&line_of(row.fields().iter()))
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Sorts the rows by cell and seed, so that two sweeps of the same flights have the same file.
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn sort(self) -> Result<(), ResultsError> {
        sort_rows(&[self.lines.path()], self.lines.path(), &self.columns).map(drop)
    }
}

/// Writes the rows of `sources` to `target`, sorted by cell and seed and each once; returns their number.
///
/// # Errors
/// A file cannot be read or written, or two rows of one flight differ.
pub fn sort_rows(sources: &[&Path], target: &Path, columns: &Columns) -> Result<u64, ResultsError> {
    // Sort the places of the rows and not the rows: a long sweep may have more rows than fit in memory.
    let mut places: Vec<(RowPlace, usize)> = Vec::new();
    let mut files = Vec::new();
    for (index, path) in sources.iter().enumerate() {
        let file = File::open(path).map_err(ResultsError::file(path, "read"))?;
        scan(&file, path, columns, |_, place| places.push((place, index)))?;
        files.push(file);
    }
    places.sort_by_key(|(place, source)| (place.cell, place.seed, *source));
    let mut rows = 0;
    let mut different = None;
    let written = replace(target, |out| {
        out.write_all(&header(columns))?;
        // Two files may both have a flight, and then both rows must be equal: cell and seed alone decide a flight of
        // one build.
        let mut last: Option<((u64, u64), Vec<u8>)> = None;
        for (place, source) in &places {
            let line = read_at(&mut files[*source], *place)?;
            let flight = (place.cell, place.seed);
            match &last {
                Some((flown, before)) if *flown == flight => {
                    if before != &line {
                        different = Some(flight);
                        // What is there stays: it may be the only place with the other row.
                        return Err(io::Error::other("two rows of a flight differ"));
                    }
                }
                _ => {
                    rows += 1;
                    out.write_all(&line)?;
                    last = Some((flight, line));
                }
            }
        }
        Ok(())
    });
    if let Some((cell, seed)) = different {
        return Err(ResultsError::other(
            target,
            format!(
                "cell {cell}, seed {seed}: two files have different rows of this flight, so they are not of one build"
            ),
        ));
    }
    written.map(|()| rows)
}

fn read_at(file: &mut File, place: RowPlace) -> io::Result<Vec<u8>> {
    let mut line = vec![0; place.bytes as usize];
    file.seek(SeekFrom::Start(place.offset))?;
    file.read_exact(&mut line)?;
    Ok(line)
}

/// Reads the rows of `path`, one at a time.
///
/// # Errors
/// The file cannot be read, or has other columns.
pub fn read_rows(path: &Path, columns: &Columns, mut each: impl FnMut(&Row)) -> Result<(), ResultsError> {
    let file = File::open(path).map_err(ResultsError::file(path, "read"))?;
    scan(&file, path, columns, |row, _| each(row))
}

/// Reads the sorted rows of `path` and puts them together cell by cell, with the spread of these figures.
///
/// # Errors
/// As [`read_rows`].
pub fn read_cells(
    path: &Path,
    definition: &Definition,
    figures: &[&Figure],
) -> Result<Vec<Cell>, ResultsError> {
    let mut cells = CellFold::new(definition, figures);
    read_rows(path, &Columns::of(definition), |row| cells.take(row))?;
    Ok(cells.finish())
}

/// Hands every whole row to `each`.
fn scan(
    file: &File,
    path: &Path,
    columns: &Columns,
    mut each: impl FnMut(&Row, RowPlace),
) -> Result<(), ResultsError> {
    let scanned = scan_lines(file, path, &header(columns), |line, offset| {
        let row = parse_line(line, columns).ok_or_else(|| damaged(path, offset))?;
        each(&row, RowPlace { cell: row.cell, seed: row.seed, offset, bytes: line.len() as u32 });
        Ok(())
    });
    scanned.map(drop)
}

fn header(columns: &Columns) -> Vec<u8> {
    line_of(columns.names().iter())
}

fn parse_line(line: &[u8], columns: &Columns) -> Option<Row> {
    Row::parse(columns, fields_of(line)?.iter())
}

/// The flight of a row, if its seed is one of the sweep's.
pub fn flight_of(row: &Row, definition: &Definition) -> Option<FlightId> {
    // A seed below the first one is of no flight of this sweep; a plain subtraction would overflow.
    let index = row.seed.checked_sub(definition.seeds.first)?;
    Some(FlightId { cell: row.cell, index })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::row::tests::{columns, row};
    use ringwing_recorder::metrics::Verdict;

    fn rows_in(path: &Path) -> Vec<(u64, u64)> {
        let mut rows = Vec::new();
        read_rows(path, &columns(), |row| rows.push((row.cell, row.seed))).unwrap();
        rows
    }

    fn write(path: &Path, rows: &[Row]) {
        let mut file = RowFile::open(path, columns(), |_| {}).unwrap();
        for row in rows {
            file.append(row).unwrap();
        }
    }

    #[test]
    fn rows_are_appended_in_any_order_and_sorted_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        write(&path, &[row(2, 1, "x", Verdict::Passed), row(0, 2, "a,b", Verdict::Violated)]);
        let mut seen = 0;
        let mut file = RowFile::open(&path, columns(), |_| seen += 1).unwrap();
        file.append(&row(0, 1, "a,b", Verdict::Passed)).unwrap();
        assert_eq!((seen, file.rows()), (2, 3));
        file.sort().unwrap();
        assert_eq!(rows_in(&path), [(0, 1), (0, 2), (2, 1)]);
    }

    #[test]
    fn a_row_torn_anywhere_is_cut_off_and_the_others_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        write(&path, &[row(0, 1, "x", Verdict::Passed), row(0, 2, "x", Verdict::Passed)]);
        let whole = fs::read(&path).unwrap();
        let first = whole
            .iter()
            .enumerate()
            .filter(|(_, byte)| **byte == b'\n')
            .map(|(at, _)| at + 1)
            .collect::<Vec<_>>();
        for end in first[1]..whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            let mut rows = 0;
            drop(RowFile::open(&path, columns(), |_| rows += 1).unwrap());
            assert_eq!(rows, 1, "torn at byte {end}");
            assert_eq!(fs::read(&path).unwrap(), &whole[..first[1]]);
        }
        // Torn within the header: the file begins anew.
        fs::write(&path, &whole[..5]).unwrap();
        drop(RowFile::open(&path, columns(), |_| panic!("no row")).unwrap());
        assert_eq!(fs::read(&path).unwrap(), &whole[..first[0]]);
    }

    #[test]
    fn a_second_process_and_another_sweep_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights.csv");
        let file = RowFile::open(&path, columns(), |_| {}).unwrap();
        let error = RowFile::open(&path, columns(), |_| {}).err().unwrap().to_string();
        assert!(error.contains("another process"), "{error}");
        drop(file);
        let other = Columns { axes: ["loss".to_owned()].into() };
        assert!(RowFile::open(&path, other, |_| {}).err().unwrap().to_string().contains("other columns"));
    }

    #[test]
    fn shards_are_joined_in_order_and_equal_rows_count_once() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other, all] = ["1", "2", "all"].map(|name| folder.path().join(name));
        write(&one, &[row(1, 1, "y", Verdict::Passed), row(0, 1, "x", Verdict::Passed)]);
        write(&other, &[row(0, 2, "x", Verdict::Passed), row(0, 1, "x", Verdict::Passed)]);
        assert_eq!(sort_rows(&[&one, &other], &all, &columns()).unwrap(), 3);
        assert_eq!(rows_in(&all), [(0, 1), (0, 2), (1, 1)]);
        write(&other, &[row(1, 1, "y", Verdict::Violated)]);
        assert!(
            sort_rows(&[&one, &other], &all, &columns()).unwrap_err().to_string().contains("different rows")
        );
        assert_eq!(rows_in(&all), [(0, 1), (0, 2), (1, 1)], "what was there stays");
    }
}
