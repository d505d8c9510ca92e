//! The documentation of structs, enums and their fields, as it stands in the source.
//!
//! Never compiles anything: it parses the files.

use super::files;
use std::{collections::BTreeMap, fs, path::Path};
use syn::{Attribute, Expr, Fields, Item, Lit, Meta, Type};

/// A field of a struct.
pub(super) struct Field {
    pub(super) name: String,
    /// The type as in the source, without spaces: `Option<f64>`, `[f64;2]`.
    pub(super) kind: String,
    pub(super) doc: String,
    /// Whether a file may leave it out.
    pub(super) has_default: bool,
}

/// A struct or an enum.
pub(super) enum Documented {
    Struct {
        doc: String,
        fields: Vec<Field>,
    },
    /// The variants with their documentation, as serde writes their names.
    Enum(Vec<(String, String)>),
}

/// Every struct and enum in the files below `folders`, by its name.
pub(super) fn documented(folders: &[&Path]) -> BTreeMap<String, Documented> {
    let mut all = BTreeMap::new();
    for file in folders.iter().flat_map(|folder| files(folder, "rs")) {
        for item in syn::parse_file(&fs::read_to_string(file).unwrap()).unwrap().items {
            match item {
                Item::Struct(item) => {
                    let is_all_default = serde(&item.attrs).contains("default");
                    let fields = fields(&item.fields, is_all_default);
                    all.insert(item.ident.to_string(), Documented::Struct { doc: doc(&item.attrs), fields });
                }
                Item::Enum(item) => {
                    let style = serde(&item.attrs);
                    let variant = |variant: &syn::Variant| {
                        (serialized(&variant.ident.to_string(), &style), doc(&variant.attrs))
                    };
                    let variants = item.variants.iter().map(variant).collect();
                    all.insert(item.ident.to_string(), Documented::Enum(variants));
                }
                _ => {}
            }
        }
    }
    all
}

fn fields(fields: &Fields, is_all_default: bool) -> Vec<Field> {
    let field = |field: &syn::Field| {
        let serde = serde(&field.attrs);
        let renamed =
            serde.split_once("rename=\"").and_then(|(_, rest)| Some(rest.split_once('"')?.0.to_owned()));
        // The fields of a tuple have no names, so they are no keys of a file and are left out.
        Some(Field {
            name: renamed.or_else(|| Some(field.ident.as_ref()?.to_string()))?,
            kind: kind(&field.ty),
            doc: doc(&field.attrs),
            has_default: is_all_default || serde.contains("default"),
        })
    };
    fields.iter().filter_map(field).collect()
}

fn kind(of: &Type) -> String {
    tokens(of)
}

/// The source of `part` without spaces.
fn tokens(part: &impl quote::ToTokens) -> String {
    part.to_token_stream().to_string().replace(' ', "")
}

/// The arguments of all `#[serde(...)]`, without spaces.
fn serde(attributes: &[Attribute]) -> String {
    let of_serde = attributes.iter().filter(|attribute| attribute.path().is_ident("serde"));
    of_serde.map(|attribute| tokens(&attribute.meta)).collect()
}

/// The name of a variant in a file.
fn serialized(name: &str, style: &str) -> String {
    let separator = if style.contains("kebab-case") { '-' } else { '_' };
    let mut text = String::new();
    for (index, c) in name.char_indices() {
        if c.is_uppercase() && index > 0 {
            text.push(separator);
        }
        text.extend(c.to_lowercase());
    }
    text
}

/// The first paragraph of the documentation, in one line, without links to other items.
fn doc(attributes: &[Attribute]) -> String {
    let line = |attribute: &Attribute| {
        let Meta::NameValue(pair) = &attribute.meta else { return None };
        let Expr::Lit(literal) = &pair.value else { return None };
        let Lit::Str(text) = &literal.lit else { return None };
        pair.path.is_ident("doc").then(|| text.value().trim().to_owned())
    };
    let lines: Vec<String> = attributes.iter().filter_map(line).collect();
    let first = lines.split(String::is_empty).next().unwrap_or_default();
    first.join(" ")
}
