//! What the summary says about the faults: how many were asked for, how many acted, and which had no effect.
//!
//! Never measures an effect, which the recorder did, and never lays out a line.

use ringwing_recorder::metrics::{FaultEffects, IdleFault};

/// Faults without effect that are listed one by one. More lines push the verdict off a terminal.
const LISTED: usize = 6;

/// A line of the summary: its label, its value and a remark.
pub(super) type EffectLine = [String; 3];

/// The lines about `effects`; none if no fault was asked for.
pub(super) fn effect_lines(effects: &FaultEffects) -> Vec<EffectLine> {
    let FaultEffects { asked, acted, without_effect } = effects;
    // A flight without faults has nothing to tell here: a line of zeros would only lengthen its summary.
    if *asked == 0 {
        return Vec::new();
    }
    let remark = format!("{acted} acted, {} without effect", without_effect.len());
    let mut lines = vec![["faults asked for".into(), asked.to_string(), remark]];
    let idle = without_effect.iter().take(LISTED);
    lines.extend(idle.map(|IdleFault { fault, reason }| {
        ["fault without effect".into(), String::new(), format!("{fault}: {reason}")]
    }));
    let more = without_effect.len().saturating_sub(LISTED);
    lines.extend((more > 0).then(|| ["more faults without effect".into(), more.to_string(), String::new()]));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(asked: u64, idle: usize) -> Vec<EffectLine> {
        let one = IdleFault { fault: "at 9 s kill uav 3".into(), reason: "uav 3 is gone already".into() };
        effect_lines(&FaultEffects { asked, acted: asked - idle as u64, without_effect: vec![one; idle] })
    }

    #[test]
    fn faults_without_effect_are_listed_with_their_reasons_and_many_are_counted() {
        assert_eq!(lines(0, 0), [[""; 3]; 0]);
        assert_eq!(lines(3, 0), [["faults asked for", "3", "3 acted, 0 without effect"]]);
        let some = lines(3, 1);
        assert_eq!(some[1], ["fault without effect", "", "at 9 s kill uav 3: uav 3 is gone already"]);
        let many = lines(20, 9);
        assert_eq!((many.len(), many[LISTED + 1][1].as_str()), (LISTED + 2, "3"));
    }
}
