//! The rows of a sweep as Parquet, with typed columns, for pandas, polars and `DuckDB`.
//!
//! Never holds more than one group of rows in memory.

use super::{
    definition::Definition,
    results::read_rows,
    row::{Columns, Row},
};
use crate::{
    figure::FIGURES,
    files::{ResultsError, replace},
};
use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::types::{Type, TypePtr},
};
use std::{
    fs::File,
    io::{self, BufWriter},
    path::Path,
    sync::Arc,
};

/// Rows of a group. Larger groups need more memory to write; smaller ones compress worse.
const GROUP: usize = 16_384;

/// Writes the rows of the CSV file `rows` to `target`. An axis whose values are all numbers becomes a column of numbers.
///
/// # Errors
/// A file cannot be read or written.
pub fn write_parquet(rows: &Path, target: &Path, definition: &Definition) -> Result<(), ResultsError> {
    let columns = Columns::of(definition);
    // The writer needs the type of every column before the first row, so the rows are read twice.
    let numeric = numeric_axes(rows, &columns)?;
    let mut group: Vec<Row> = Vec::new();
    let mut failure: Option<ParquetError> = None;
    replace(target, |file| {
        let mut table =
            Table { columns: &columns, numeric: &numeric, file: open(file, &columns, &numeric, definition)? };
        // The closure cannot stop the reading, so the first failure waits in `failure` until the last row is read.
        let read = read_rows(rows, &columns, |row| {
            group.push(row.clone());
            if group.len() == GROUP {
                keep(&mut failure, table.write_group(&group));
                group.clear();
            }
        });
        read.map_err(io::Error::other)?;
        keep(&mut failure, if group.is_empty() { Ok(()) } else { table.write_group(&group) });
        keep(&mut failure, table.file.close().map(drop));
        failure.take().map_or(Ok(()), |failure| Err(io::Error::other(failure)))
    })
}

/// Keeps the first failure.
fn keep(failure: &mut Option<ParquetError>, result: Result<(), ParquetError>) {
    if let Err(error) = result {
        failure.get_or_insert(error);
    }
}

/// Which axes have only numbers in these rows.
fn numeric_axes(rows: &Path, columns: &Columns) -> Result<Vec<bool>, ResultsError> {
    let mut numeric = vec![true; columns.axes.len()];
    read_rows(rows, columns, |row| {
        for (is_numeric, value) in numeric.iter_mut().zip(&row.values) {
            *is_numeric &= value.parse::<f64>().is_ok();
        }
    })?;
    Ok(numeric)
}

fn open<'a>(
    file: &'a mut BufWriter<File>,
    columns: &Columns,
    numeric: &[bool],
    definition: &Definition,
) -> io::Result<SerializedFileWriter<&'a mut BufWriter<File>>> {
    let text = serde_json::to_string(definition).unwrap_or_default();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(vec![KeyValue::new("ringwing.sweep".to_owned(), text)]))
        .build();
    let schema = schema(columns, numeric).map_err(io::Error::other)?;
    SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(io::Error::other)
}

fn schema(columns: &Columns, numeric: &[bool]) -> Result<TypePtr, ParquetError> {
    // The order is that of the columns in CSV. `write_group` fills the columns one after the other, so both must
    // agree.
    let mut fields = vec![whole("cell")?, whole("seed")?];
    for (name, is_numeric) in columns.axes.iter().zip(numeric) {
        fields.push(if *is_numeric { number(name)? } else { text(name)? });
    }
    fields.extend([text("verdict")?, text("violated")?]);
    for figure in &FIGURES {
        fields.push(number(figure.name)?);
    }
    fields.extend([text("payload_hash")?, text("failure")?]);
    Ok(Arc::new(Type::group_type_builder("flight").with_fields(fields).build()?))
}

fn whole(name: &str) -> Result<TypePtr, ParquetError> {
    let required = Type::primitive_type_builder(name, Physical::INT64).with_repetition(Repetition::REQUIRED);
    Ok(Arc::new(required.build()?))
}

fn number(name: &str) -> Result<TypePtr, ParquetError> {
    let optional = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(optional.build()?))
}

fn text(name: &str) -> Result<TypePtr, ParquetError> {
    let optional = Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
        .with_logical_type(Some(LogicalType::String))
        .with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(optional.build()?))
}

/// A table that is being written.
struct Table<'a, 'f> {
    columns: &'a Columns,
    numeric: &'a [bool],
    file: SerializedFileWriter<&'f mut BufWriter<File>>,
}

type Group<'g, 'f> = SerializedRowGroupWriter<'g, &'f mut BufWriter<File>>;

impl Table<'_, '_> {
    fn write_group(&mut self, rows: &[Row]) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        // Seeds are at most 2^63 - 1, and a sweep has fewer cells.
        write_whole(&mut group, rows.iter().map(|row| row.cell.cast_signed()))?;
        write_whole(&mut group, rows.iter().map(|row| row.seed.cast_signed()))?;
        for (place, is_numeric) in (0..self.columns.axes.len()).zip(self.numeric) {
            if *is_numeric {
                write::<DoubleType>(&mut group, rows.iter().map(|row| row.values[place].parse().ok()))?;
            } else {
                write_texts(&mut group, rows.iter().map(|row| Some(row.values[place].clone())))?;
            }
        }
        write_texts(&mut group, rows.iter().map(|row| Some(row.verdict.name().to_owned())))?;
        write_texts(&mut group, rows.iter().map(|row| Some(row.violated.join(" "))))?;
        for place in 0..FIGURES.len() {
            write::<DoubleType>(&mut group, rows.iter().map(|row| row.figures[place]))?;
        }
        write_texts(&mut group, rows.iter().map(|row| row.payload_hash.clone()))?;
        write_texts(&mut group, rows.iter().map(|row| row.failure.clone()))?;
        group.close().map(drop)
    }
}

fn write_texts(group: &mut Group, texts: impl Iterator<Item = Option<String>>) -> Result<(), ParquetError> {
    write::<ByteArrayType>(group, texts.map(|text| text.map(|text| ByteArray::from(text.into_bytes()))))
}

fn write_whole(group: &mut Group, values: impl Iterator<Item = i64>) -> Result<(), ParquetError> {
    let values: Vec<i64> = values.collect();
    write_column::<Int64Type>(group, &values, None)
}

/// Writes a column in which values may be absent.
fn write<T: DataType>(
    group: &mut Group,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    // Parquet stores only the values that are there; a level of 0 instead of 1 marks a row without a value.
    let (mut present, mut levels) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        present.extend(value);
    }
    write_column::<T>(group, &present, Some(&levels))
}

fn write_column<T: DataType>(
    group: &mut Group,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let column = group.next_column()?;
    let mut column = column.ok_or_else(|| ParquetError::General("the schema has too few columns".into()))?;
    column.typed::<T>().write_batch(values, levels, None)?;
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Draft, results::RowFile, row::tests::row};
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::RowAccessor,
    };
    use ringwing_recorder::metrics::Verdict;

    #[test]
    fn a_parquet_file_has_the_rows_of_the_csv_file_with_types() {
        let folder = tempfile::tempdir().unwrap();
        let [rows, target] = ["flights.csv", "flights.parquet"].map(|name| folder.path().join(name));
        let sweep = "scenario = \"paper-4.1\"\nfaults = [\"at 1 s link all delay {delay} s\"]\n[axes]\ndelay = [0.5, 1]";
        let sweep = Draft::parse("x", sweep).unwrap().finish().unwrap();
        let mut file = RowFile::open(&rows, Columns::of(&sweep), |_| {}).unwrap();
        file.append(&row(0, 1, "0.5", Verdict::Passed)).unwrap();
        file.append(&row(1, 2, "1", Verdict::Violated)).unwrap();
        drop(file);
        write_parquet(&rows, &target, &sweep).unwrap();
        let reader = SerializedFileReader::new(File::open(&target).unwrap()).unwrap();
        let names: Vec<_> = reader
            .metadata()
            .file_metadata()
            .schema()
            .get_fields()
            .iter()
            .map(|field| field.name().to_owned())
            .collect();
        assert_eq!(names, Columns::of(&sweep).names());
        let read: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(read.len(), 2);
        assert_eq!((read[1].get_long(0).unwrap(), read[1].get_long(1).unwrap()), (1, 2));
        assert_eq!(
            (read[1].get_double(2).unwrap(), read[1].get_string(3).unwrap().as_str()),
            (1.0, "violated")
        );
        assert_eq!(read[1].get_double(5).unwrap(), 14.5);
        assert!(read[1].get_double(6).is_err(), "an absent number is null");
        let text = reader.metadata().file_metadata().key_value_metadata().unwrap()[0].value.clone().unwrap();
        assert!(text.contains("paper-4.1"));
    }
}
