//! What the figures depend on; nothing that would tell machines of one kind apart.

use std::{env::consts, fs, thread};

use super::said;

/// Names and values, of the machine and of its compiler.
pub(super) fn facts() -> Result<Vec<(&'static str, String)>, String> {
    let cores = thread::available_parallelism().map_err(|error| format!("cores: {error}"))?;
    Ok(vec![
        ("cores", cores.to_string()),
        (
            "memory",
            format!("{:.0} GiB", memory()? / f64::from(1 << 30)),
        ),
        ("system", format!("{} {}", consts::OS, consts::ARCH)),
        ("compiler", said("rustc", &["--version"])?),
        ("date", said("date", &["-u", "+%Y-%m-%d"])?),
    ])
}

/// In bytes.
fn memory() -> Result<f64, String> {
    let (text, unit) = match fs::read_to_string("/proc/meminfo") {
        Ok(table) => (table.split_whitespace().nth(1).unwrap_or("").into(), 1024.0),
        Err(_) => (said("sysctl", &["-n", "hw.memsize"])?, 1.0),
    };
    let number: f64 = text.parse().map_err(|_| "memory: no size was found")?;
    Ok(number * unit)
}
