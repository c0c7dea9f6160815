//! Compiles what connects C++ libraries, where they are asked for.

fn main() {
    println!("cargo::rerun-if-changed=src/nanoflann.cpp");
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "nanoflann-cpp")]
    cc::Build::new()
        .cpp(true)
        .std("c++17")
        .opt_level(3)
        .file("src/nanoflann.cpp")
        .compile("caustics_nanoflann");
}
