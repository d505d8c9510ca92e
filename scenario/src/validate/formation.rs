//! Bounds of the formation: its quantities, its listed offsets, and how it closes after a loss.
//!
//! Never builds a formation from values that are wrong: its geometry would have no meaning.

use super::{
    UAVS_MAX, UAVS_MIN, angle,
    violation::{CheckedQuantity, Violation, quantity},
};
use crate::{FormationSection, Scenario, ShapeName};
use ringwing_flight::{OnLoss, counted};

/// Largest sweep of a vee, in degrees. At 60 degrees the two slots beside the tip are L apart; with more they would be
/// nearer to each other than neighbours.
const VEE_SWEEP_MAX_DEG: f64 = 60.0;

/// The bounds of each quantity by itself.
pub(super) fn quantities(scenario: &Scenario) -> impl Iterator<Item = Violation> {
    let formation = &scenario.formation;
    let fewest = if scenario.ipc.few_uavs { 1 } else { UAVS_MIN };
    [
        quantity("formation.uavs", formation.uavs).within(f64::from(fewest)..=f64::from(UAVS_MAX)),
        quantity("formation.spacing_m", formation.spacing_m).above_zero(),
        angle("formation.bearing_deg", formation.bearing_deg),
    ]
    .into_iter()
    .flatten()
    .chain(shape(scenario, formation, "formation"))
}

/// The bounds of what only some shapes have, in the formation that `section` describes.
pub(super) fn shape(scenario: &Scenario, formation: &FormationSection, section: &str) -> Vec<Violation> {
    let key = |name: &str| format!("{section}.{name}");
    [
        quantity(&key("sweep_deg"), formation.sweep_deg).within(-90.0..=90.0),
        // A longer ellipse is a line; its slots on the narrow sides would be far from their neighbours.
        quantity(&key("aspect"), formation.aspect).within(0.2..=5.0),
        // With a smaller one all inner slots are at the centre, and the outer ones far away.
        quantity(&key("inner_ratio"), formation.inner_ratio).within(0.1..=1.0),
        quantity(&key("columns"), formation.columns).within(0.0..=f64::from(UAVS_MAX)),
        steep_vee(formation, section),
        radius_to_keep(scenario, formation.shape, section),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn steep_vee(formation: &FormationSection, section: &str) -> Option<Violation> {
    let is_steep = formation.shape == ShapeName::Vee && formation.sweep_deg.abs() > VEE_SWEEP_MAX_DEG;
    is_steep.then(|| {
        let key = format!("{section}.sweep_deg");
        let sweep = quantity(&key, formation.sweep_deg).measure();
        let message = format!(
            "at {sweep}, the arms of a vee are nearer to each other than L: give -{VEE_SWEEP_MAX_DEG} to \
             {VEE_SWEEP_MAX_DEG}"
        );
        Violation::at(key.clone(), message.clone()).or_at(format!("{section}.shape"), message)
    })
}

/// Only a shape that goes round the centre has a radius to keep after a loss.
fn radius_to_keep(scenario: &Scenario, shape: ShapeName, section: &str) -> Option<Violation> {
    let has_radius = matches!(shape, ShapeName::Ring | ShapeName::Ellipse | ShapeName::Star);
    let keeps_radius = scenario.control.ring_closes && scenario.membership.on_loss == OnLoss::KeepRadius;
    (keeps_radius && !has_radius).then(|| {
        let shape = shape.name();
        let message =
            format!("the shape {shape:?} has no radius to keep: give \"keep_spacing\" or \"keep_slots\"");
        Violation::at("membership.on_loss", &*message).or_at(format!("{section}.shape"), message)
    })
}

/// Listed offsets: as many as UAVs, and far enough apart.
pub(super) fn offsets(scenario: &Scenario) -> Vec<Violation> {
    let formation = &scenario.formation;
    let (listed, uavs) = (formation.offsets.len(), formation.uavs);
    if formation.shape != ShapeName::Offsets && !fly_offsets(scenario) {
        return (listed > 0).then(|| unused(formation)).into_iter().collect();
    }
    if listed != uavs as usize {
        let offsets = counted(listed, "offset");
        let are = if listed == 1 { "is" } else { "are" };
        let message = format!("{offsets} {are} listed, but formation.uavs is {uavs}: list one for each UAV");
        let counted = Violation::at("formation.offsets", &*message).or_at("formation.uavs", &*message);
        return vec![counted.or_at("formation.shape", message)];
    }
    let collision = quantity("airframe.collision_distance_m", scenario.airframe.collision_distance_m);
    let separation = quantity("safety.separation_m", scenario.safety.separation_m);
    let kept = scenario.control.collision_filter.then_some(separation);
    [Some(collision), kept].into_iter().flatten().filter_map(|least| too_close(formation, least)).collect()
}

/// Whether any manoeuvre flies the listed offsets.
fn fly_offsets(scenario: &Scenario) -> bool {
    scenario.manoeuvres.iter().any(|manoeuvre| manoeuvre.shape == Some(ShapeName::Offsets))
}

fn unused(formation: &FormationSection) -> Violation {
    let message = format!(
        "{} in the list, but formation.shape is {:?}: give shape = \"offsets\", or an empty list",
        counted(formation.offsets.len(), "offset"),
        formation.shape.name()
    );
    Violation::at("formation.offsets", &*message).or_at("formation.shape", message)
}

/// Two listed slots that are not farther apart than `least`.
fn too_close(formation: &FormationSection, least: CheckedQuantity<'_>) -> Option<Violation> {
    // Wrong numbers have messages of their own.
    if formation.spacing_m <= 0.0 || formation.offsets.is_empty() {
        return None;
    }
    let listed = FormationSection { shape: ShapeName::Offsets, ..formation.clone() };
    let (one, other, apart_m) = listed.geometry().closest()?;
    (apart_m <= least.value).then(|| {
        let key = |slot: u32| format!("formation.offsets.{}", slot - 1);
        let message = format!(
            "slots {one} and {other} are {apart_m:.2} m apart, which is not above {} {}: move one of them",
            least.key,
            least.measure()
        );
        Violation::at(key(other), &*message).or_at(key(one), &*message).or_at(least.key, message)
    })
}
