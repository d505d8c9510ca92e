//! HDR histograms as text: `HdrHistogram`'s V2 encoding, deflated, in base64, as other tools read it.
//!
//! Must never trust a text: it may come from a damaged file.

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use flate2::{Decompress, FlushDecompress};
use hdrhistogram::{
    Histogram,
    serialization::{Deserializer, Serializer as _, V2DeflateSerializer},
};

/// Significant digits of a value in the distribution. A fourth one would make files ten times as long.
pub(crate) const DIGITS: u8 = 3;
/// Length of the header of an encoding: cookie, length of the counts, offset, digits, lowest and highest value, ratio.
const HEADER_BYTES: usize = 40;
/// Most bytes that an encoding is inflated to. With three digits and 64 bits, it has at most 56 000 counts of nine bytes.
const MAX_ENCODING_BYTES: usize = 1 << 20;

/// Why a text is not a histogram that ringwing wrote.
#[derive(Debug, thiserror::Error)]
pub(crate) enum HdrError {
    #[error("`hdr` is not base64: {0}; measure again, or use the original file")]
    Base64(base64::DecodeError),
    #[error("`hdr` is not an HDR histogram: {0}; measure again, or use the original file")]
    Histogram(hdrhistogram::serialization::DeserializeError),
    #[error("`hdr` does not have the length that it claims; measure again, or use the original file")]
    Length,
    #[error("`hdr` has a resolution that ringwing does not write; measure again")]
    Resolution,
}

/// `histogram` in `HdrHistogram`'s V2 encoding, deflated, in base64.
pub(crate) fn encoded(histogram: &Histogram<u64>) -> String {
    let mut bytes = Vec::new();
    let written = V2DeflateSerializer::new().serialize(histogram, &mut bytes);
    assert!(written.is_ok(), "writing to memory does not fail");
    BASE64.encode(bytes)
}

pub(crate) fn decoded(text: &str) -> Result<Histogram<u64>, HdrError> {
    let bytes = BASE64.decode(text).map_err(HdrError::Base64)?;
    let plain = inflated(&bytes).ok_or(HdrError::Length)?;
    let mut histogram: Histogram<u64> =
        Deserializer::new().deserialize(&mut plain.as_slice()).map_err(HdrError::Histogram)?;
    // Let it grow like a histogram that was recorded here: two results may be merged.
    histogram.auto(true);
    // With another resolution, percentiles would be less exact than `Latencies` promises.
    let is_ours = histogram.sigfig() == DIGITS && histogram.low() == 1;
    is_ours.then_some(histogram).ok_or(HdrError::Resolution)
}

/// Inflates an encoding; `None` if it does not have the length that it claims.
///
/// The deserializer allocates whatever length an encoding claims, up to 4 GiB, so a damaged one must not reach it.
fn inflated(bytes: &[u8]) -> Option<Vec<u8>> {
    let (_cookie_and_length, deflated) = bytes.split_at_checked(8)?;
    // Inflating stops at the capacity of the vector.
    let mut plain = Vec::with_capacity(MAX_ENCODING_BYTES);
    Decompress::new(true).decompress_vec(deflated, &mut plain, FlushDecompress::Finish).ok()?;
    let (header, counts) = plain.split_at_checked(HEADER_BYTES)?;
    let claimed: [u8; 4] = header.get(4..8)?.try_into().ok()?;
    (u32::from_be_bytes(claimed) as usize == counts.len()).then_some(plain)
}
