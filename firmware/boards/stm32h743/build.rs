//! Linker arguments. Memory regions are those of `memory.x` at the root.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../../../memory.x");
    for argument in ["--nmagic", "--build-id", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
