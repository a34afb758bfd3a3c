//! Gates on the ARM images: no panic, the same numbers, and what they cost.
//!
//! Without QEMU or the ARM target these tests pass over it and say so; with `BACKSEAT_REQUIRE_QEMU` set
//! in the environment they fail instead.

mod cost;
#[path = "../../../firmware/boards/mps2/tests/exercise/mod.rs"]
mod exercise;
mod image;
mod stack;
mod thumb;

/// core, wire and app link with a panic handler that does not exist.
#[test]
fn no_panic_can_be_reached() {
    if image::ready() {
        image::build("backseat-mps2", "nopanic").unwrap_or_else(|error| panic!("{error:#}"));
    }
}

/// Every computation gives the same bits on the Cortex-M7 as on this computer.
#[test]
fn val_numbers_are_the_same_on_the_target() {
    if !image::ready() {
        return;
    }
    let on_target = image::build("backseat-mps2", "vectors")
        .and_then(|image| image::run(&image))
        .unwrap_or_else(|e| panic!("{e:#}"));
    let mut here = Vec::new();
    let mut objects = Box::new(exercise::vectors::Objects::new());
    exercise::vectors::run(&mut objects, &mut |name, digest| here.push(format!("{digest:016x} {name}")));
    let mut on_target = on_target.lines();
    let different: Vec<_> = here.iter().filter(|line| on_target.next() != Some(line)).collect();
    assert!(different.is_empty(), "other bits on the target: {different:#?}");
    assert_eq!(on_target.next(), None);
}

/// Everything costs what docs/results/cost.md says, and no more than it may.
#[test]
fn regress_cost() {
    if !image::ready() {
        return;
    }
    let measure = || -> anyhow::Result<_> {
        let rows = cost::rows(&image::run(&image::build("backseat-mps2", "cost")?)?);
        let [qemu, h743] = ["backseat-mps2", "backseat-stm32h743"].map(|name| image::build(name, name));
        let (qemu, h743) = (qemu?, h743?);
        let images = [image::examine("backseat-mps2", &qemu)?, image::examine("backseat-stm32h743", &h743)?];
        let mut stacks = stack::bounds("backseat-mps2", &std::fs::read(&qemu)?)?;
        stacks.extend(stack::bounds("backseat-stm32h743", &std::fs::read(&h743)?)?);
        Ok((rows, images, stacks))
    };
    let (rows, images, stacks) = measure().unwrap_or_else(|error| panic!("{error:#}"));
    let table = cost::markdown(&rows, &images, &stacks);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/results/cost.md");
    if std::env::var_os("BACKSEAT_WRITE_COST").is_some() {
        std::fs::write(path, &table).unwrap();
    }
    let violations = cost::violations(&rows, &images, &stacks);
    assert!(violations.is_empty(), "over budget:\n{}", violations.join("\n"));
    let changed = cost::drift(&std::fs::read_to_string(path).unwrap_or_default(), &table);
    assert!(changed.is_empty(), "docs/results/cost.md is out of date; see its second line:\n{}", changed.join("\n"));
}
