//! Finds the known word that a misspelled one was probably meant to be.
//!
//! Never replaces a word, only suggests one.

/// Least similarity at which a word is suggested; 1 means equal. A larger value misses typos in short words, a smaller
/// one suggests unrelated words.
const SIMILARITY_MIN: f64 = 0.7;

/// The word in `known` most similar to `word`, if it is similar enough to suggest.
///
/// `text_of` gives the part of a known word to compare.
pub(crate) fn nearest<'k, T: ?Sized>(
    word: &str,
    known: impl IntoIterator<Item = &'k T>,
    text_of: impl Fn(&'k T) -> &'k str,
) -> Option<&'k T> {
    let similarity = |known| strsim::normalized_damerau_levenshtein(word, text_of(known));
    let rated = known.into_iter().map(|known| (similarity(known), known));
    let (similarity, nearest) = rated.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (similarity >= SIMILARITY_MIN).then_some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn suggestion(word: &str) -> Option<&'static str> {
        nearest(word, ["kill", "stop", "delay"], |known| known)
    }

    #[test]
    fn a_typo_leads_to_the_nearest_word_and_an_unrelated_word_to_none() {
        assert_eq!(suggestion("kil"), Some("kill"));
        assert_eq!(suggestion("dealy"), Some("delay"));
        assert_eq!(suggestion("explode"), None);
        assert_eq!(suggestion(""), None);
    }
}
