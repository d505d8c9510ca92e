//! Histograms for other tools: `.hgrm` files for HDR histogram plotters, `.hdr` interval logs for log processors.
//!
//! Must never merge cases: each case has its own `.hdr`, and each of its hops its own `.hgrm`.

use crate::{
    label,
    latencies::Latencies,
    quantity,
    result::{Hop, Measured, Results},
};
use hdrhistogram::serialization::{
    V2DeflateSerializer,
    interval_log::{IntervalLogWriter, IntervalLogWriterBuilder, Tag},
};
use ringwing_bus::write_whole;
use std::{fs, io, path::Path, time::Duration};

/// The version of the log format; readers choose their parser by it.
const LOG_FORMAT: &str = "[Histogram log format version 1.3]";
const LOG_COLUMNS: &str =
    "\"StartTimestamp\",\"Interval_Length\",\"Interval_Max\",\"Interval_Compressed_Histogram\"\n";
/// Histograms hold nanoseconds; the readable maximum in a log is in milliseconds, as other tools write it.
const NS_PER_MS: f64 = 1e6;
const NS_PER_US: f64 = 1e3;
/// Lines in a `.hgrm` per halving of the remaining share; the default of the other tools.
const LINES_PER_HALVING: u32 = 5;
/// Sub-buckets per bucket in a histogram that keeps three digits; the `.hgrm` footer states it.
const SUB_BUCKETS: u32 = 2048;

/// Writes the files of all cases into `folder`, and creates it if necessary.
pub(crate) fn write(folder: &Path, results: &Results) -> io::Result<()> {
    fs::create_dir_all(folder).map_err(|error| named(folder, &error))?;
    for measured in &results.cases {
        let case = label::file(&measured.case);
        put(&folder.join(format!("{case}.hdr")), &log(results, measured)?)?;
        for hop in quantity::hops(measured) {
            let file = folder.join(format!("{case}.{}.hgrm", label::hop_file(hop)));
            put(&file, percentiles(&quantity::all_samples(measured, hop)).as_bytes())?;
        }
    }
    Ok(())
}

fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_whole(path, bytes).map_err(|error| named(path, &error))
}

/// The same error with the file's name.
fn named(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: cannot be written: {error}", path.display()))
}

/// All repeats of a case as an interval log. Each hop has histograms of its own, tagged with its name.
fn log(results: &Results, measured: &Measured) -> io::Result<Vec<u8>> {
    let began = humantime::parse_rfc3339(&results.began)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, format!("`began`: {error}")))?;
    let mut log = Vec::new();
    let mut serializer = V2DeflateSerializer::new();
    IntervalLogWriterBuilder::new()
        .add_comment(&format!("[ringwing bench {}: {}]", results.ringwing, label::case(&measured.case)))
        .add_comment(LOG_FORMAT)
        // Repeats count their seconds from the base time.
        .with_start_time(began)
        .with_base_time(began)
        .begin_log_with(&mut log, &mut serializer)?;
    // The library does not write the line of column names that other readers expect.
    log.extend_from_slice(LOG_COLUMNS.as_bytes());
    let mut writer = IntervalLogWriterBuilder::new()
        .with_max_value_divisor(NS_PER_MS)
        .begin_log_with(&mut log, &mut serializer)?;
    for repeat in &measured.repeats {
        let times = (duration(repeat.began_s), duration(repeat.took_s));
        repeat.hops.iter().try_for_each(|(hop, samples)| interval(&mut writer, times, *hop, samples))?;
    }
    Ok(log)
}

/// Seconds as a duration; 0 for a number that is not a valid duration, which a damaged result may hold.
fn duration(s: f64) -> Duration {
    Duration::try_from_secs_f64(s).unwrap_or_default()
}

fn interval(
    writer: &mut IntervalLogWriter<Vec<u8>, V2DeflateSerializer>,
    (began, took): (Duration, Duration),
    hop: Hop,
    samples: &Latencies,
) -> io::Result<()> {
    let tag = Tag::new(label::hop_file(hop));
    let written = writer.write_histogram(samples.histogram(), began, took, tag);
    written.map_err(|error| io::Error::other(error.to_string()))
}

/// The percentiles of `samples` in microseconds, in the columns that plotters of HDR histograms read.
fn percentiles(samples: &Latencies) -> String {
    let mut text =
        format!("{:>12} {:>14} {:>10} {:>14}\n\n", "Value", "Percentile", "TotalCount", "1/(1-Percentile)");
    let mut count = 0;
    for step in samples.histogram().iter_quantiles(LINES_PER_HALVING) {
        count += step.count_since_last_iteration();
        // The upper end of the last bucket may exceed the exact maximum.
        let most = samples.max_ns().unwrap_or_default();
        let value = step.value_iterated_to().min(most) as f64 / NS_PER_US;
        let share = step.quantile_iterated_to();
        // In the last line nothing remains above, so 1 / (1 - share) does not exist.
        let inverse = if share < 1.0 { format!(" {:>14.2}", 1.0 / (1.0 - share)) } else { String::new() };
        text.extend([format!("{value:>12.3} {share:>14.12} {count:>10}"), inverse, "\n".into()]);
    }
    text + &footer(samples)
}

fn footer(samples: &Latencies) -> String {
    let histogram = samples.histogram();
    let (mean, deviation) = (histogram.mean() / NS_PER_US, histogram.stdev() / NS_PER_US);
    let most = samples.max_ns().unwrap_or_default() as f64 / NS_PER_US;
    format!(
        "#[Mean    = {mean:>12.3}, StdDeviation   = {deviation:>12.3}]\n\
         #[Max     = {most:>12.3}, Total count    = {:>12}]\n\
         #[Buckets = {:>12}, SubBuckets     = {SUB_BUCKETS:>12}]\n",
        samples.n(),
        histogram.buckets(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        case::{Carrier, Load},
        example,
    };
    use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
    use hdrhistogram::{
        Histogram,
        serialization::{
            Deserializer,
            interval_log::{IntervalLogIterator, LogEntry},
        },
    };

    #[test]
    fn a_log_is_read_back_as_the_histograms_in_it() {
        let results = example::results();
        let measured = example::find(&results, Carrier::Swarm, Load::Closed, 6);
        let log = log(&results, measured).unwrap();
        let entries: Vec<LogEntry> = IntervalLogIterator::new(&log).map(Result::unwrap).collect();
        // 2026-11-22T20:00:00Z
        let began = Duration::from_secs(1_795_377_600);
        assert_eq!(entries[..2], [LogEntry::StartTime(began), LogEntry::BaseTime(began)]);
        let mut expected = Vec::new();
        for repeat in &measured.repeats {
            expected.extend(repeat.hops.iter().map(|(hop, samples)| (repeat, *hop, samples)));
        }
        assert_eq!(entries.len() - 2, expected.len());
        for (entry, (repeat, hop, samples)) in entries[2..].iter().zip(expected) {
            let LogEntry::Interval(interval) = entry else { panic!("{entry:?}") };
            assert_eq!(interval.tag().unwrap().as_str(), label::hop_file(hop));
            assert_eq!(interval.start_timestamp().as_secs_f64(), repeat.began_s);
            assert!((interval.duration().as_secs_f64() - repeat.took_s).abs() < 1e-3);
            let bytes = BASE64.decode(interval.encoded_histogram()).unwrap();
            let read: Histogram<u64> = Deserializer::new().deserialize(&mut bytes.as_slice()).unwrap();
            assert_eq!(&read, samples.histogram());
        }
    }

    #[test]
    fn a_log_begins_with_what_its_readers_expect() {
        let results = example::results();
        let text = String::from_utf8(log(&results, &results.cases[0]).unwrap()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "#[ringwing bench 0.1.0: swarm, 1 UAV, closed loop]");
        assert_eq!(lines[1], "#[Histogram log format version 1.3]");
        assert_eq!(lines[2], "#[StartTime: 1795377600.000 (seconds since epoch)]");
        assert_eq!(lines[4], LOG_COLUMNS.trim_end());
        assert!(lines[6].starts_with("Tag=wake,0.000,0.014,"), "{}", lines[6]);
        // Every implementation encodes compressed V2 histograms with this beginning.
        assert!(lines[6].contains(",HISTFAAA"), "{}", lines[6]);
    }

    #[test]
    fn percentiles_are_in_the_columns_that_plotters_read() {
        let mut samples = Latencies::new();
        (1..=4).for_each(|us| samples.record(1_000 * us));
        let text = percentiles(&samples);
        let mut lines = text.lines();
        assert_eq!(lines.next().unwrap(), "       Value     Percentile TotalCount 1/(1-Percentile)");
        assert_eq!(lines.next().unwrap(), "");
        assert_eq!(lines.next().unwrap(), "       1.000 0.000000000000          1           1.00");
        // 2000 ns has a bucket of its own; 3000 ns shares its bucket with 3001 ns.
        assert!(text.contains("\n       2.000 0.500000000000          2           2.00\n"), "{text}");
        assert!(text.contains("\n       4.000 1.000000000000          4\n"), "{text}");
        assert!(text.contains("#[Max     =        4.000, Total count    =            4]\n"), "{text}");
    }

    #[test]
    fn percentiles_never_fall_and_the_last_line_counts_every_sample() {
        let results = example::results();
        let samples = quantity::all_samples(&results.cases[0], Hop::Tick);
        let text = percentiles(&samples);
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(2)
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect())
            .collect();
        assert!(rows.len() > 30, "{text}");
        assert!(rows.is_sorted_by(|a, b| a[0] <= b[0] && a[1] <= b[1] && a[2] <= b[2]), "{text}");
        assert_eq!(rows.last().unwrap()[2], samples.n() as f64);
        for row in rows.iter().filter(|row| row.len() == 4) {
            assert!((row[3] - 1.0 / (1.0 - row[1])).abs() < 0.01 + 1e-3 * row[3], "{row:?}");
        }
    }

    #[test]
    fn every_case_and_every_hop_has_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let results = example::results();
        let inner = folder.path().join("histograms");
        write(&inner, &results).unwrap();
        let names: Vec<String> = fs::read_dir(&inner)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        let hops: usize = results.cases.iter().map(|measured| quantity::hops(measured).len()).sum();
        assert_eq!(names.len(), results.cases.len() + hops, "{names:?}");
        assert!(names.contains(&"swarm-6-paced-100hz.tick.hgrm".into()), "{names:?}");
        assert!(names.contains(&"pipe-30-closed.hdr".into()), "{names:?}");
    }

    #[test]
    fn the_error_names_a_folder_that_cannot_be_created() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = write(&file.path().join("below"), &example::results()).unwrap_err().to_string();
        assert!(error.contains("below: cannot be written: "), "{error}");
    }
}
