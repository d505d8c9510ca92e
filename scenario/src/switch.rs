//! The switches of the law's parts: what the law sets, and what a scenario sets itself.
//!
//! Never reads a file nor judges a value: a law that is none is refused with the rest.

use crate::{Law, origin, setting};
use std::sync::LazyLock;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// The key of the law.
pub(crate) const LAW: &str = "control.law";

/// The resilient law's switches as TOML.
static RESILIENT: LazyLock<String> = LazyLock::new(|| {
    toml::to_string(&Law::Resilient.switches()).expect("switches are texts and truth values")
});

/// The law that `tree` asks for; of none, and of one that is not known, the default.
pub(crate) fn law(tree: &DeValue<'_>) -> Law {
    match origin::trace(tree, LAW).value.and_then(DeValue::as_str) {
        Some(name) if name == Law::Resilient.name() => Law::Resilient,
        _ => Law::Paper,
    }
}

/// Takes those switches out of `tree` that are not among `keys`.
pub(crate) fn drop_unset(tree: &mut DeValue<'_>, keys: &[String]) {
    let DeValue::Table(root) = tree else { return };
    let Some(DeValue::Table(control)) = root.get_mut("control").map(Spanned::get_mut) else { return };
    for (name, _) in &switches() {
        if !keys.contains(&key(name.get_ref())) {
            control.remove(name.get_ref().as_ref());
        }
    }
}

/// Puts the resilient law's switches into a `tree` that asks for that law, where they are not set.
pub(crate) fn complete(tree: &mut Spanned<DeValue<'_>>) {
    if law(tree.get_ref()) == Law::Paper {
        return;
    }
    for (name, value) in switches() {
        let key = key(name.get_ref());
        if origin::trace(tree.get_ref(), &key).value.is_none() {
            let set = setting::put(tree, &key, Spanned::new(0..0, value.into_inner()));
            set.expect("a tree with a law has a section for it");
        }
    }
}

fn switches() -> DeTable<'static> {
    DeTable::parse(&RESILIENT).expect("what is written as TOML is TOML").into_inner()
}

fn key(name: &str) -> String {
    format!("control.{name}")
}
