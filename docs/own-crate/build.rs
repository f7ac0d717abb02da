//! Tells the program where MuJoCo's library is.

fn main() {
    if let Ok(folder) = std::env::var("DEP_RATELAB_LAB_RPATH") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}
