//! What the user wishes: at once by a key, or as a fault that is typed and confirmed.
//!
//! Must never do what is wished.

use ratatui::crossterm::event::KeyCode;

/// The longest fault that can be typed. A longer one does not fit on any terminal; the command line takes it.
const LONGEST: usize = 200;

/// What the user wishes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wish {
    /// Stand still, or go on.
    Toggle,
    /// Go on by this many ticks.
    Step(u32),
    /// Play a log faster.
    Faster,
    /// Play a log slower.
    Slower,
    /// This fault.
    Fault(String),
}

/// The line in which the user types a fault.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) enum Prompt {
    /// The user does not type.
    #[default]
    Closed,
    /// The user types a sentence.
    Typing(String),
    /// The user is asked whether to send it.
    Asking(String),
}

impl Prompt {
    /// Whether keys belong to the prompt.
    pub(super) fn is_open(&self) -> bool {
        *self != Self::Closed
    }

    /// Lets the user type.
    pub(super) fn open(&mut self) {
        *self = Self::Typing(String::new());
    }

    /// Takes a key; returns the fault once the user has confirmed it.
    pub(super) fn on_key(&mut self, key: KeyCode) -> Option<Wish> {
        match (std::mem::take(self), key) {
            // Enter does not confirm: whoever presses it once more by habit would send the fault.
            (Self::Asking(sentence), KeyCode::Char('y' | 'Y')) => return Some(Wish::Fault(sentence)),
            (Self::Typing(sentence), KeyCode::Enter) if !sentence.trim().is_empty() => {
                *self = Self::Asking(sentence.trim().to_owned());
            }
            (Self::Typing(mut sentence), KeyCode::Char(letter)) => {
                if sentence.chars().count() < LONGEST {
                    sentence.push(letter);
                }
                *self = Self::Typing(sentence);
            }
            (Self::Typing(mut sentence), KeyCode::Backspace) => {
                sentence.pop();
                *self = Self::Typing(sentence);
            }
            // Arrows do nothing here, but closing the prompt would lose what was typed.
            (Self::Typing(sentence), KeyCode::Left | KeyCode::Right | KeyCode::Up | KeyCode::Down) => {
                *self = Self::Typing(sentence);
            }
            // Every other key closes the prompt: nothing is sent by mistake.
            _ => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(text: &str) -> Prompt {
        let mut prompt = Prompt::default();
        prompt.open();
        for letter in text.chars() {
            assert_eq!(prompt.on_key(KeyCode::Char(letter)), None);
        }
        prompt
    }

    #[test]
    fn a_fault_is_sent_only_after_it_was_confirmed() {
        let mut prompt = typed("kill uav 33");
        prompt.on_key(KeyCode::Backspace);
        assert_eq!(prompt.on_key(KeyCode::Enter), None);
        assert_eq!(prompt, Prompt::Asking("kill uav 3".into()));
        assert_eq!(prompt.on_key(KeyCode::Char('y')), Some(Wish::Fault("kill uav 3".into())));
        assert!(!prompt.is_open());
    }

    #[test]
    fn every_other_key_sends_nothing() {
        for key in [KeyCode::Char('n'), KeyCode::Esc, KeyCode::Enter, KeyCode::Char('q')] {
            let mut prompt = typed("kill uav 3");
            prompt.on_key(KeyCode::Enter);
            assert_eq!((prompt.on_key(key), prompt.is_open()), (None, false), "{key:?}");
        }
        let mut prompt = typed("  ");
        assert_eq!((prompt.on_key(KeyCode::Enter), prompt.is_open()), (None, false));
    }
}
