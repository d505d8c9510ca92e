//! Fills in the switches of the control law that a scenario leaves out.
//!
//! Never refuses a value: an unknown law counts as the default here, and is reported with the other wrong values.

use super::tree::{self, lookup};
use crate::Law;
use std::sync::LazyLock;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// The key of the law.
pub(super) const LAW: &str = "control.law";

/// The switches of the resilient law as TOML. The paper's law needs no table: its switches are the defaults.
static RESILIENT: LazyLock<String> = LazyLock::new(|| {
    toml::to_string(&Law::Resilient.switches()).expect("switches are texts, booleans and numbers")
});

/// The law that `tree` asks for, or the default if it names no known law.
pub(super) fn law(tree: &DeValue<'_>) -> Law {
    match lookup(tree, LAW).value.and_then(DeValue::as_str) {
        Some(name) if name == Law::Resilient.name() => Law::Resilient,
        _ => Law::Paper,
    }
}

/// Removes the law's switches from `tree`, apart from those in `keys`.
pub(super) fn remove_except(tree: &mut DeValue<'_>, keys: &[String]) {
    // A file may have a plain value in place of a section. `fit` reports that later.
    let DeValue::Table(root) = tree else { return };
    let Some(DeValue::Table(control)) = root.get_mut("control").map(Spanned::get_mut) else { return };
    for (name, _) in &switches() {
        if !keys.contains(&key(name.get_ref())) {
            control.remove(name.get_ref().as_ref());
        }
    }
}

/// Adds the switches that `tree` leaves out, if it asks for the resilient law.
pub(super) fn fill_in(tree: &mut Spanned<DeValue<'_>>) {
    if law(tree.get_ref()) == Law::Paper {
        return;
    }
    for (name, value) in switches() {
        let key = key(name.get_ref());
        if lookup(tree.get_ref(), &key).value.is_none() {
            // No message ever shows this position, because a law's own switches are never wrong.
            let added = tree::put(tree, &key, Spanned::new(0..0, value.into_inner()));
            added.expect("a tree that names a law has a section for it");
        }
    }
}

fn switches() -> DeTable<'static> {
    DeTable::parse(&RESILIENT).expect("serialized TOML parses").into_inner()
}

fn key(name: &str) -> String {
    format!("control.{name}")
}
