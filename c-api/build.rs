//! Links the shared library so that it stays once it was loaded.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Its worker threads wait in its code for the next call: a program that takes it away from under them ends.
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
