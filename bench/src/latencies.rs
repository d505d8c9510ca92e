//! All samples of one hop: their distribution to three significant digits, and their exact minimum and maximum.
//!
//! Must never report a percentile that rests on too few samples, and must never accept a file whose parts contradict each
//! other.

use crate::hdr::{self, DIGITS, HdrError};
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The percentiles that are reported: their names, and their shares of the samples.
pub(crate) const PERCENTILES: [(&str, f64); 5] =
    [("p50", 0.5), ("p90", 0.9), ("p99", 0.99), ("p99.9", 0.999), ("p99.99", 0.9999)];
/// Samples that must be expected beyond a percentile for it to be reported. With fewer, chance decides it.
const MIN_BEYOND: u32 = 10;
/// Rounding error of a share times a count: 100 (1 - 0.9) gives 9.999999999999998. Larger would move exact limits.
const ROUNDING: f64 = 1e-6;

/// Durations in nanoseconds; no sample is left out.
///
/// Percentiles come from an HDR histogram: they are exact below 2048 ns and at most 0.1 % too large above. Minimum and
/// maximum are exact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenLatencies", into = "WrittenLatencies")]
pub(crate) struct Latencies {
    histogram: Histogram<u64>,
    /// Minimum and maximum, if there are any samples.
    ends_ns: Option<(u64, u64)>,
}

impl Default for Latencies {
    fn default() -> Self {
        Self::new()
    }
}

impl Latencies {
    /// No samples yet.
    pub(crate) fn new() -> Self {
        let Ok(histogram) = Histogram::new(DIGITS) else { unreachable!("{DIGITS} digits are allowed") };
        Self { histogram, ends_ns: None }
    }

    /// Adds one sample.
    pub(crate) fn record(&mut self, ns: u64) {
        self.widen(ns, ns);
        let recorded = self.histogram.record(ns);
        assert!(recorded.is_ok(), "the histogram resizes itself up to the largest number");
    }

    /// Adds all samples of `other`.
    pub(crate) fn merge(&mut self, other: &Self) {
        let Some((least, most)) = other.ends_ns else { return };
        self.widen(least, most);
        let added = self.histogram.add(&other.histogram);
        assert!(added.is_ok(), "the histogram resizes itself to hold every other");
    }

    fn widen(&mut self, least: u64, most: u64) {
        let (low, high) = self.ends_ns.unwrap_or((least, most));
        self.ends_ns = Some((low.min(least), high.max(most)));
    }

    /// Number of samples.
    pub(crate) fn n(&self) -> u64 {
        self.histogram.len()
    }

    /// The exact minimum.
    pub(crate) fn min_ns(&self) -> Option<u64> {
        self.ends_ns.map(|(least, _)| least)
    }

    /// The exact maximum.
    pub(crate) fn max_ns(&self) -> Option<u64> {
        self.ends_ns.map(|(_, most)| most)
    }

    /// The shortest duration that a share `q` of the samples does not exceed: the sample number ceil(q n) of n sorted ones.
    ///
    /// `None` if fewer than ten samples are expected beyond it: a handful of samples would decide such a percentile, and it
    /// would vary widely between repeats. p50 needs 20 samples, p99 1000, and p99.99 100 000.
    pub(crate) fn percentile(&self, q: f64) -> Option<u64> {
        let expected_beyond = self.n() as f64 * (1.0 - q);
        (expected_beyond + ROUNDING >= f64::from(MIN_BEYOND)).then(|| self.at_share(q)).flatten()
    }

    /// Like [`Self::percentile`], but for any number of samples, because curves go on to the last sample.
    pub(crate) fn at_share(&self, q: f64) -> Option<u64> {
        let (least, most) = self.ends_ns?;
        let n = self.n() as f64;
        let place = (q * n - ROUNDING).ceil().clamp(1.0, n);
        // Ask for the middle of the sample's share: at its end, rounding could yield the next sample.
        Some(self.histogram.value_at_quantile((place - 0.5) / n).clamp(least, most))
    }

    /// The distribution, for tools that read HDR histograms; its minimum and maximum are rounded.
    pub(crate) fn histogram(&self) -> &Histogram<u64> {
        &self.histogram
    }

    /// The percentiles that may be reported, by their name in JSON.
    fn percentiles(&self) -> BTreeMap<String, u64> {
        let named = |(name, q): &(&str, f64)| Some((format!("{name}_ns"), self.percentile(*q)?));
        PERCENTILES.iter().filter_map(named).collect()
    }
}

/// Latencies in JSON: figures for people, and the distribution for programs.
#[derive(Serialize, Deserialize)]
struct WrittenLatencies {
    n: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_ns: Option<u64>,
    /// `p50_ns` and so on; percentiles that rest on too few samples are absent.
    #[serde(flatten)]
    percentiles: BTreeMap<String, u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_ns: Option<u64>,
    /// The distribution: `HdrHistogram`'s V2 encoding, deflated, in base64.
    hdr: String,
}

impl From<Latencies> for WrittenLatencies {
    fn from(samples: Latencies) -> Self {
        Self {
            n: samples.n(),
            min_ns: samples.min_ns(),
            max_ns: samples.max_ns(),
            hdr: hdr::encoded(&samples.histogram),
            percentiles: samples.percentiles(),
        }
    }
}

/// Why latencies in a file are not accepted.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LatencyError {
    #[error(transparent)]
    Hdr(#[from] HdrError),
    #[error("`{0}` contradicts `hdr`: the file was changed or is damaged; measure again")]
    Contradiction(String),
}

impl TryFrom<WrittenLatencies> for Latencies {
    type Error = LatencyError;

    fn try_from(written: WrittenLatencies) -> Result<Self, LatencyError> {
        // If the file has only one of the two ends, `contradiction` notices.
        let samples =
            Self { histogram: hdr::decoded(&written.hdr)?, ends_ns: written.min_ns.zip(written.max_ns) };
        match samples.contradiction(&written) {
            Some(field) => Err(LatencyError::Contradiction(field)),
            None => Ok(samples),
        }
    }
}

impl Latencies {
    /// The first field that contradicts the distribution.
    fn contradiction(&self, written: &WrittenLatencies) -> Option<String> {
        let histogram = &self.histogram;
        let (least, most) = (histogram.min(), histogram.max());
        // The histogram knows minimum and maximum only to three digits.
        let agrees = |value: Option<u64>, end| match value {
            Some(value) => self.n() > 0 && histogram.equivalent(value, end),
            None => self.n() == 0,
        };
        if written.n != self.n() {
            return Some("n".into());
        }
        if !agrees(written.min_ns, least) || written.min_ns > written.max_ns {
            return Some("min_ns".into());
        }
        if !agrees(written.max_ns, most) {
            return Some("max_ns".into());
        }
        let percentiles = self.percentiles();
        // Names of both sides: a percentile may be missing in the file, or be there without enough samples.
        let names = percentiles.keys().chain(written.percentiles.keys());
        names.into_iter().find(|name| percentiles.get(*name) != written.percentiles.get(*name)).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hdr::{decoded, encoded};
    use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
    use flate2::{Compression, write::ZlibEncoder};
    use hdrhistogram::serialization::{Serializer as _, V2Serializer};
    use proptest::{collection::vec, prelude::*};
    use std::io::Write;

    fn of(values: impl IntoIterator<Item = u64>) -> Latencies {
        let mut samples = Latencies::new();
        values.into_iter().for_each(|ns| samples.record(ns));
        samples
    }

    #[test]
    fn a_hundred_samples_are_enough_for_the_median_and_p90_only() {
        let samples = of((1..=100).map(|i| 10 * i));
        assert_eq!((samples.n(), samples.min_ns(), samples.max_ns()), (100, Some(10), Some(1000)));
        // The 50th and the 90th of 10, 20, ... 1000.
        assert_eq!([0.5, 0.9, 0.99].map(|q| samples.percentile(q)), [Some(500), Some(900), None]);
    }

    #[test]
    fn a_percentile_needs_ten_samples_beyond_it() {
        for (q, least) in [(0.5, 20), (0.9, 100), (0.99, 1_000), (0.999, 10_000), (0.9999, 100_000)] {
            let mut samples = of(0..least - 1);
            assert_eq!(samples.percentile(q), None, "{q} of {}", least - 1);
            samples.record(least);
            assert!(samples.percentile(q).is_some(), "{q} of {least}");
        }
    }

    #[test]
    fn one_late_sample_in_a_thousand_shows_only_at_the_maximum() {
        // 990 samples of 7 ns, 9 of 100 ns, and one of 5 s: the 990th is the last fast one.
        let samples = of([7; 990].into_iter().chain([100; 9]).chain([5_000_000_001]));
        assert_eq!(samples.percentile(0.99), Some(7));
        assert_eq!(samples.at_share(0.991), Some(100));
        assert_eq!(samples.at_share(0.999), Some(100));
        assert_eq!(samples.at_share(1.0), Some(5_000_000_001));
        assert_eq!(samples.max_ns(), Some(5_000_000_001));
    }

    #[test]
    fn values_are_exact_below_2048_ns_and_within_a_thousandth_above() {
        let samples = of([2_047; 20]);
        assert_eq!(samples.percentile(0.5), Some(2_047));
        // 1_000_003 ns lies in a bucket of 512 ns that ends at 1_000_447 ns.
        let samples = of([1_000_003; 20].into_iter().chain([2_000_000; 20]));
        assert_eq!(samples.percentile(0.5), Some(1_000_447));
    }

    #[test]
    fn latencies_without_samples_have_no_figures() {
        let none = Latencies::new();
        assert_eq!((none.n(), none.min_ns(), none.max_ns(), none.percentile(0.0)), (0, None, None, None));
        let text = serde_json::to_string(&none).unwrap();
        assert!(text.starts_with("{\"n\":0,\"hdr\":\""), "{text}");
        assert_eq!(serde_json::from_str::<Latencies>(&text).unwrap(), none);
    }

    #[test]
    fn durations_of_hours_and_more_are_kept() {
        let day_ns = 86_400_000_000_000;
        assert_eq!(of([1, day_ns]).max_ns(), Some(day_ns));
        assert_eq!(of([0, u64::MAX]).max_ns(), Some(u64::MAX));
    }

    #[test]
    fn json_has_figures_for_people() {
        let json = serde_json::to_value(of((1..=100).map(|i| 10 * i))).unwrap();
        assert_eq!(json["n"], 100);
        assert_eq!((&json["min_ns"], &json["max_ns"]), (&10.into(), &1000.into()));
        assert_eq!((&json["p50_ns"], &json["p90_ns"]), (&500.into(), &900.into()));
        assert_eq!(json.get("p99_ns"), None);
    }

    /// The encoding of a thousand samples, with `change` applied before it is deflated.
    fn deflated(change: impl FnOnce(&mut Vec<u8>)) -> String {
        let mut plain = Vec::new();
        V2Serializer::new().serialize(of(1..=1000).histogram(), &mut plain).unwrap();
        change(&mut plain);
        let mut bytes = vec![0x1c, 0x84, 0x93, 0x14, 0, 0, 0, 0];
        let mut encoder = ZlibEncoder::new(&mut bytes, Compression::fast());
        encoder.write_all(&plain).unwrap();
        encoder.finish().unwrap();
        BASE64.encode(bytes)
    }

    /// The error of reading a thousand samples after `change`, or "accepted".
    fn reading(change: impl FnOnce(&mut serde_json::Value)) -> String {
        let mut json = serde_json::to_value(of(1..=1000)).unwrap();
        change(&mut json);
        serde_json::from_value::<Latencies>(json)
            .map_or_else(|error| error.to_string(), |_| "accepted".into())
    }

    #[test]
    fn the_error_names_the_field_that_was_changed() {
        for (field, value) in [("n", 999), ("min_ns", 2), ("max_ns", 1001), ("p50_ns", 501), ("p77_ns", 1)] {
            let said = reading(|json| json[field] = value.into());
            assert!(said.contains(&format!("`{field}` contradicts `hdr`")), "{said}");
        }
        let said = reading(|json| drop(json.as_object_mut().unwrap().remove("max_ns")));
        assert!(said.contains("`min_ns` contradicts") || said.contains("`max_ns` contradicts"), "{said}");
        assert_eq!(reading(|_| ()), "accepted");
    }

    #[test]
    fn an_encoding_that_is_not_a_histogram_is_refused() {
        assert!(reading(|json| json["hdr"] = "&%$".into()).contains("`hdr` is not base64"));
        assert!(reading(|json| json["hdr"] = "AAAA".into()).contains("`hdr` does not have the length"));
        // A changed cookie behind the deflated header.
        let other = deflated(|plain| plain[0] = 0);
        assert!(reading(|json| json["hdr"] = other.into()).contains("`hdr` is not an HDR histogram"));
        let endless = deflated(|plain| plain[4] = 0xff);
        assert!(reading(|json| json["hdr"] = endless.into()).contains("`hdr` does not have the length"));
        let coarse = encoded(&Histogram::new(1).unwrap());
        assert!(reading(|json| json["hdr"] = coarse.into()).contains("resolution"));
    }

    proptest! {
        #[test]
        fn percentiles_match_the_sorted_samples(
            mut values in vec(0_u64..20_000_000_000, 1..400), q in 0.0..1.0_f64
        ) {
            let samples = of(values.iter().copied());
            values.sort_unstable();
            let place = ((q * values.len() as f64).ceil() as usize).max(1);
            let exact = values[place - 1];
            let told = samples.at_share(q).unwrap();
            prop_assert!(told >= exact && (told - exact) as f64 <= 1e-3 * exact as f64, "{told} for {exact}");
            prop_assert_eq!(samples.min_ns(), values.first().copied());
            prop_assert_eq!(samples.max_ns(), values.last().copied());
            prop_assert_eq!(samples.percentile(q).is_some(), values.len() as f64 * (1.0 - q) >= 10.0);
        }

        #[test]
        fn merging_equals_recording_the_samples_of_both(a in vec(0..1_u64 << 36, 0..60), b in vec(0..1_u64 << 36, 0..60)) {
            let mut merged = of(a.iter().copied());
            merged.merge(&of(b.iter().copied()));
            let together = of(a.iter().chain(&b).copied());
            prop_assert_eq!(merged.n(), (a.len() + b.len()) as u64);
            prop_assert_eq!((merged.min_ns(), merged.max_ns()), (together.min_ns(), together.max_ns()));
            for q in [0.1, 0.5, 0.9, 1.0] {
                prop_assert_eq!(merged.at_share(q), together.at_share(q));
            }
        }

        #[test]
        fn written_latencies_are_read_back_equal(values in vec(0..1_u64 << 36, 0..100)) {
            let samples = of(values);
            let text = serde_json::to_string(&samples).unwrap();
            prop_assert_eq!(serde_json::from_str::<Latencies>(&text).unwrap(), samples);
        }

        #[test]
        fn random_bytes_are_refused_without_a_panic(bytes in vec(any::<u8>(), 0..80)) {
            prop_assert!(decoded(&BASE64.encode(&bytes)).is_err());
        }

        #[test]
        fn a_damaged_histogram_never_panics(place in 0_usize..200, byte in any::<u8>()) {
            let changed = deflated(|plain| {
                let place = place % plain.len();
                plain[place] = byte;
            });
            // If it can be read, the other fields still have to agree with it.
            if let Ok(histogram) = decoded(&changed) {
                prop_assert_eq!(histogram.sigfig(), DIGITS);
            }
        }
    }
}
