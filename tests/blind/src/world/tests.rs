//! Whole draws.

use super::*;

#[test]
fn a_draw_depends_on_its_seed_index_and_world_alone() {
    let spec = WorldSpec { class: Some(Class::Common), ..WorldSpec::of(World::Laboratory) };
    let once = draw_world(5, 2, &spec);
    assert_eq!(once, draw_world(5, 2, &spec));
    assert_ne!(once.valve, draw_world(6, 2, &spec).valve);
    assert_ne!(once.valve, draw_world(5, 3, &spec).valve);
    let plant = WorldSpec { class: Some(Class::Common), ..WorldSpec::of(World::Plant) };
    assert_ne!(once.valve, draw_world(5, 2, &plant).valve);
}
