//! Finds out whether this compiler lets the crate say what follows a refused allocation: `cfg(alloc_error_hook)`.

use std::io::Write;
use std::process::{Command, Stdio};

const PROBE: &str = "#![feature(alloc_error_hook)] pub fn probe() { std::alloc::set_alloc_error_hook(|_| ()); }";

fn main() {
    println!("cargo::rustc-check-cfg=cfg(alloc_error_hook)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=RUSTC_BOOTSTRAP");
    if compiles() == Some(true) {
        println!("cargo::rustc-cfg=alloc_error_hook");
    } else {
        println!(
            "cargo::warning=without RUSTC_BOOTSTRAP=surfrecon_allocator an allocation that fails ends the program"
        );
    }
}

fn compiles() -> Option<bool> {
    let variable = |name| std::env::var_os(name);
    let mut compiler = Command::new(variable("RUSTC")?)
        .args(["--crate-name", "surfrecon_allocator", "--crate-type", "lib", "--emit", "metadata", "--target"])
        // Not the target: its standard library may be compiled only with this program.
        .arg(variable("HOST")?)
        .arg("--out-dir")
        .arg(variable("OUT_DIR")?)
        .arg("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    compiler.stdin.take()?.write_all(PROBE.as_bytes()).ok()?;
    Some(compiler.wait().ok()?.success())
}
