//! What the summary says about the faults: how many were asked for, how many acted, and which had no effect.
//!
//! Never measures an effect: the recorder did.

use super::text::line;
use ringwing_recorder::metrics::{FaultEffects, IdleFault};
use std::fmt;

/// Faults without effect that are listed one by one. More lines push the verdict off a terminal.
const LISTED: usize = 6;

/// Writes the lines about `effects`; none if no fault was asked for.
pub(super) fn write_effects(f: &mut fmt::Formatter<'_>, effects: &FaultEffects) -> fmt::Result {
    let FaultEffects { asked, acted, without_effect } = effects;
    if *asked == 0 {
        return Ok(());
    }
    let remark = format!("{acted} acted, {} without effect", without_effect.len());
    line(f, "faults asked for", &asked.to_string(), &remark)?;
    for IdleFault { fault, reason } in without_effect.iter().take(LISTED) {
        line(f, "fault without effect", "", &format!("{fault}: {reason}"))?;
    }
    match without_effect.len().saturating_sub(LISTED) {
        0 => Ok(()),
        more => line(f, "more faults without effect", &more.to_string(), ""),
    }
}
