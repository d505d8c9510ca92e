//! Gives the shared library the name under which programs look for it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // The number of the ABI. Programs that are linked with one number never start with a library of another one, so it changes
    // only if the header changes in a way that programs already built cannot follow.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libringwing.so.1");
}
