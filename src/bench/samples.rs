//! Every sample of one hop: its distribution to three significant digits, and its exact ends.
//!
//! Never tells a percentile that too few samples stand behind, and never believes a file whose parts disagree.

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::read::ZlibDecoder;
use hdrhistogram::{
    Histogram,
    serialization::{Deserializer, Serializer as _, V2DeflateSerializer},
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, io::Read};

/// The percentiles that are told, by name and as shares of the sample.
pub(crate) const PERCENTILES: [(&str, f64); 5] =
    [("p50", 0.5), ("p90", 0.9), ("p99", 0.99), ("p99.9", 0.999), ("p99.99", 0.9999)];
/// A percentile is told if at least this many samples are expected beyond it.
pub(crate) const BEYOND: u32 = 10;
/// Digits of a value that the distribution keeps.
const DIGITS: u8 = 3;
/// Of an encoding: cookie, length of the counts, offset, digits, least and most value, ratio.
const HEADER_BYTES: usize = 40;
/// Three digits and 64 bits take 56 000 counts at most, each of nine bytes at most.
const LONGEST_BYTES: u64 = 1 << 20;
/// What a product of a share and a whole number may be off by: 100 (1 - 0.9) is 9.999999999999998.
const ROUNDING: f64 = 1e-6;

/// Durations in nanoseconds, none left out.
///
/// A percentile comes from an HDR histogram: it is exact below 2048 ns and within 0.1 % above. Least and most are exact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub(crate) struct Samples {
    histogram: Histogram<u64>,
    /// The least and the most, if there are any.
    ends_ns: Option<(u64, u64)>,
}

impl Default for Samples {
    fn default() -> Self {
        Self::new()
    }
}

impl Samples {
    /// None yet.
    pub(crate) fn new() -> Self {
        let Ok(histogram) = Histogram::new(DIGITS) else { unreachable!("{DIGITS} digits are allowed") };
        Self { histogram, ends_ns: None }
    }

    /// Takes one more.
    pub(crate) fn record(&mut self, ns: u64) {
        self.widen(ns, ns);
        let recorded = self.histogram.record(ns);
        assert!(recorded.is_ok(), "the histogram grows up to the largest number there is");
    }

    /// Takes all of `other` as well.
    pub(crate) fn merge(&mut self, other: &Self) {
        let Some((least, most)) = other.ends_ns else { return };
        self.widen(least, most);
        let added = self.histogram.add(&other.histogram);
        assert!(added.is_ok(), "a growing histogram has room for every other");
    }

    fn widen(&mut self, least: u64, most: u64) {
        let (low, high) = self.ends_ns.unwrap_or((least, most));
        self.ends_ns = Some((low.min(least), high.max(most)));
    }

    /// How many there are.
    pub(crate) fn n(&self) -> u64 {
        self.histogram.len()
    }

    /// The least of them, exactly.
    pub(crate) fn min_ns(&self) -> Option<u64> {
        self.ends_ns.map(|(least, _)| least)
    }

    /// The most of them, exactly.
    pub(crate) fn max_ns(&self) -> Option<u64> {
        self.ends_ns.map(|(_, most)| most)
    }

    /// The least duration that a share `q` of the samples does not exceed: of n sorted samples the one at place ceil(q n).
    ///
    /// None where fewer than [`BEYOND`] samples are expected beyond it: such a percentile is decided by a handful of
    /// samples, and would differ widely from one repeat to the next. p50 takes 20 samples, p99 1000, p99.99 100 000.
    pub(crate) fn percentile(&self, q: f64) -> Option<u64> {
        let expected_beyond = self.n() as f64 * (1.0 - q);
        (expected_beyond + ROUNDING >= f64::from(BEYOND)).then(|| self.at_share(q)).flatten()
    }

    /// The same, however few they are; for curves that go on to the last sample.
    pub(crate) fn at_share(&self, q: f64) -> Option<u64> {
        let (least, most) = self.ends_ns?;
        let n = self.n() as f64;
        let place = (q * n - ROUNDING).ceil().clamp(1.0, n);
        // Asked for half a place before, so that no rounding moves it to the next.
        Some(self.histogram.value_at_quantile((place - 0.5) / n).clamp(least, most))
    }

    /// The distribution, for what reads HDR histograms; its ends are rounded.
    pub(crate) fn histogram(&self) -> &Histogram<u64> {
        &self.histogram
    }

    fn told(&self) -> BTreeMap<String, u64> {
        let told = |(name, q): &(&str, f64)| Some((format!("{name}_ns"), self.percentile(*q)?));
        PERCENTILES.iter().filter_map(told).collect()
    }
}

/// How samples are written down.
#[derive(Serialize, Deserialize)]
struct Written {
    n: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_ns: Option<u64>,
    /// `p50_ns` and so on; what too few samples stand behind is absent.
    #[serde(flatten)]
    percentiles: BTreeMap<String, u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_ns: Option<u64>,
    /// `HdrHistogram`'s V2 encoding, deflated, in base64.
    hdr: String,
}

impl From<Samples> for Written {
    fn from(samples: Samples) -> Self {
        Self {
            n: samples.n(),
            min_ns: samples.min_ns(),
            max_ns: samples.max_ns(),
            hdr: encoded(&samples.histogram),
            percentiles: samples.told(),
        }
    }
}

/// Why samples that were read are none of ours.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Damage {
    #[error("`hdr` is not base64: {0}; measure again, or take the file as it was written")]
    Base64(base64::DecodeError),
    #[error("`hdr` is no HDR histogram: {0}; measure again, or take the file as it was written")]
    Histogram(hdrhistogram::serialization::DeserializeError),
    #[error("`hdr` is not as long as it says; measure again, or take the file as it was written")]
    Length,
    #[error("`hdr` has a resolution that ringwing does not write; measure again")]
    Resolution,
    #[error("`{0}` does not agree with `hdr`: the file was changed or is damaged; measure again")]
    Disagreement(String),
}

impl TryFrom<Written> for Samples {
    type Error = Damage;

    fn try_from(written: Written) -> Result<Self, Damage> {
        let samples = Self { histogram: decoded(&written.hdr)?, ends_ns: written.min_ns.zip(written.max_ns) };
        match samples.disagreement(&written) {
            Some(field) => Err(Damage::Disagreement(field)),
            None => Ok(samples),
        }
    }
}

impl Samples {
    /// Which field says something else than the distribution.
    fn disagreement(&self, written: &Written) -> Option<String> {
        let histogram = &self.histogram;
        let (least, most) = (histogram.min(), histogram.max());
        let end_is = |value: Option<u64>, end| match value {
            Some(value) => self.n() > 0 && histogram.equivalent(value, end),
            None => self.n() == 0,
        };
        if written.n != self.n() {
            return Some("n".into());
        }
        if !end_is(written.min_ns, least) || written.min_ns > written.max_ns {
            return Some("min_ns".into());
        }
        if !end_is(written.max_ns, most) {
            return Some("max_ns".into());
        }
        let told = self.told();
        let names = told.keys().chain(written.percentiles.keys());
        names.into_iter().find(|name| told.get(*name) != written.percentiles.get(*name)).cloned()
    }
}

/// `histogram` in `HdrHistogram`'s V2 encoding, deflated, in base64.
fn encoded(histogram: &Histogram<u64>) -> String {
    let mut bytes = Vec::new();
    let written = V2DeflateSerializer::new().serialize(histogram, &mut bytes);
    assert!(written.is_ok(), "memory takes every byte");
    BASE64.encode(bytes)
}

fn decoded(text: &str) -> Result<Histogram<u64>, Damage> {
    let bytes = BASE64.decode(text).map_err(Damage::Base64)?;
    let plain = inflated(&bytes).ok_or(Damage::Length)?;
    let mut histogram: Histogram<u64> =
        Deserializer::new().deserialize(&mut plain.as_slice()).map_err(Damage::Histogram)?;
    histogram.auto(true);
    let is_ours = histogram.sigfig() == DIGITS && histogram.low() == 1;
    is_ours.then_some(histogram).ok_or(Damage::Resolution)
}

/// The encoding within a deflated one, if it is as long as it says.
///
/// The reader of encodings makes room for whatever length one claims, up to 4 GiB: a damaged one must not get there.
fn inflated(bytes: &[u8]) -> Option<Vec<u8>> {
    let (_cookie_and_length, deflated) = bytes.split_at_checked(8)?;
    let mut plain = Vec::new();
    ZlibDecoder::new(deflated).take(LONGEST_BYTES).read_to_end(&mut plain).ok()?;
    let (header, counts) = plain.split_at_checked(HEADER_BYTES)?;
    let claimed: [u8; 4] = header.get(4..8)?.try_into().ok()?;
    (u32::from_be_bytes(claimed) as usize == counts.len()).then_some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use hdrhistogram::serialization::V2Serializer;
    use proptest::{collection::vec, prelude::*};
    use std::io::Write;

    fn of(values: impl IntoIterator<Item = u64>) -> Samples {
        let mut samples = Samples::new();
        values.into_iter().for_each(|ns| samples.record(ns));
        samples
    }

    #[test]
    fn a_hundred_samples_tell_their_median_and_p90_and_no_more() {
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
    fn one_late_sample_in_a_thousand_is_seen_where_it_belongs() {
        // 990 at 7 ns, 9 at 100 ns, one at 5 s: the 990th is the last of the fast ones.
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
        // 1_000_003 lies in a bucket of 512 ns, which ends at 1_000_447.
        let samples = of([1_000_003; 20].into_iter().chain([2_000_000; 20]));
        assert_eq!(samples.percentile(0.5), Some(1_000_447));
    }

    #[test]
    fn none_at_all_say_nothing() {
        let none = Samples::new();
        assert_eq!((none.n(), none.min_ns(), none.max_ns(), none.percentile(0.0)), (0, None, None, None));
        let text = serde_json::to_string(&none).unwrap();
        assert!(text.starts_with("{\"n\":0,\"hdr\":\""), "{text}");
        assert_eq!(serde_json::from_str::<Samples>(&text).unwrap(), none);
    }

    #[test]
    fn hours_are_held() {
        let day_ns = 86_400_000_000_000;
        assert_eq!(of([1, day_ns]).max_ns(), Some(day_ns));
        assert_eq!(of([0, u64::MAX]).max_ns(), Some(u64::MAX));
    }

    #[test]
    fn json_has_what_people_read_and_what_programs_need() {
        let json = serde_json::to_value(of((1..=100).map(|i| 10 * i))).unwrap();
        assert_eq!(json["n"], 100);
        assert_eq!((&json["min_ns"], &json["max_ns"]), (&10.into(), &1000.into()));
        assert_eq!((&json["p50_ns"], &json["p90_ns"]), (&500.into(), &900.into()));
        assert_eq!(json.get("p99_ns"), None);
    }

    /// The encoding of a thousand samples, changed before it is deflated.
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

    /// What reading says after `change` was made to a written sample.
    fn reading(change: impl FnOnce(&mut serde_json::Value)) -> String {
        let mut json = serde_json::to_value(of(1..=1000)).unwrap();
        change(&mut json);
        serde_json::from_value::<Samples>(json).map_or_else(|error| error.to_string(), |_| "taken".into())
    }

    #[test]
    fn what_was_changed_is_refused_by_name() {
        for (field, value) in [("n", 999), ("min_ns", 2), ("max_ns", 1001), ("p50_ns", 501), ("p77_ns", 1)] {
            let said = reading(|json| json[field] = value.into());
            assert!(said.contains(&format!("`{field}` does not agree with `hdr`")), "{said}");
        }
        let said = reading(|json| drop(json.as_object_mut().unwrap().remove("max_ns")));
        assert!(
            said.contains("`min_ns` does not agree") || said.contains("`max_ns` does not agree"),
            "{said}"
        );
        assert_eq!(reading(|_| ()), "taken");
    }

    #[test]
    fn what_is_no_histogram_is_refused() {
        assert!(reading(|json| json["hdr"] = "&%$".into()).contains("`hdr` is not base64"));
        assert!(reading(|json| json["hdr"] = "AAAA".into()).contains("`hdr` is not as long as it says"));
        // The cookie within, changed.
        let other = deflated(|plain| plain[0] = 0);
        assert!(reading(|json| json["hdr"] = other.into()).contains("`hdr` is no HDR histogram"));
        let endless = deflated(|plain| plain[4] = 0xff);
        assert!(reading(|json| json["hdr"] = endless.into()).contains("`hdr` is not as long as it says"));
        let coarse = encoded(&Histogram::new(1).unwrap());
        assert!(reading(|json| json["hdr"] = coarse.into()).contains("resolution"));
    }

    proptest! {
        #[test]
        fn percentiles_are_those_of_the_sorted_samples(
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
        fn merged_samples_are_those_of_both(a in vec(0..1_u64 << 36, 0..60), b in vec(0..1_u64 << 36, 0..60)) {
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
        fn what_is_written_reads_back_equal(values in vec(0..1_u64 << 36, 0..100)) {
            let samples = of(values);
            let text = serde_json::to_string(&samples).unwrap();
            prop_assert_eq!(serde_json::from_str::<Samples>(&text).unwrap(), samples);
        }

        #[test]
        fn any_text_in_the_place_of_the_histogram_is_refused_calmly(bytes in vec(any::<u8>(), 0..80)) {
            prop_assert!(decoded(&BASE64.encode(&bytes)).is_err());
        }

        #[test]
        fn a_damaged_histogram_never_panics(place in 0_usize..200, byte in any::<u8>()) {
            let changed = deflated(|plain| {
                let place = place % plain.len();
                plain[place] = byte;
            });
            // What can be read is held against the other fields by its reader.
            if let Ok(histogram) = decoded(&changed) {
                prop_assert_eq!(histogram.sigfig(), DIGITS);
            }
        }
    }
}
