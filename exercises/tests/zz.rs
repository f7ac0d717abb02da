//! Temporary.
#[test]
fn zz() {
    for ex in exercises::questions().filter(|e| e.brief().number >= 6 || e.brief().number == 1) {
        let t = std::time::Instant::now();
        let f = ex.measure(0).expect("m");
        println!(
            "=== {} {} {:?}\n{}\n{:?}\n{}",
            ex.brief().label(),
            ex.brief().title,
            t.elapsed(),
            f.table,
            f.answer,
            f.meaning
        );
        for m in &f.measurements {
            println!("BAND {}\t{}\t{}", ex.brief().name, m.name, m.value);
        }
    }
    for s in 1..5 {
        for ex in exercises::questions()
            .filter(|e| ["one-law", "one-law-jitter"].contains(&e.brief().name))
        {
            let f = ex.measure(s).expect("m");
            println!("SEED {s}\n{}{:?}", f.table, f.answer);
        }
    }
}
