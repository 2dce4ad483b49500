//! Every check on a mesh that has just that fault.

use super::*;
use crate::mesh::{Point, Vector};
use crate::size;
use crate::surface::shapes::{ball, joined, sheet};
use alternatives::Alternative;
use lacuna::format::Unit;

fn mesh(mesh: Mesh) -> Checked {
    super::mesh(Loaded { mesh, repairs: vec![] })
}

fn texts(checked: &Checked) -> String {
    checked.findings.iter().map(|finding| finding.text.as_str()).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_clean_mesh_stays_as_it_is_and_says_nothing() {
    for clean in [ball(12, 4.0), sheet(5)] {
        let checked = mesh(clean.clone());
        assert_eq!((checked.mesh.triangles == clean.triangles, texts(&checked)), (true, String::new()));
    }
}

#[test]
fn flat_triangles_copies_and_unused_vertices_are_left_out() {
    let mut odd = sheet(4);
    let clean = odd.clone();
    odd.points.push(Point::new(1000.0, 0.0, 0.0));
    let [a, b, c] = odd.triangles[0];
    odd.triangles.extend([[b, c, a], [a, a, b]]);
    let checked = mesh(odd);
    assert_eq!(checked.mesh, clean);
    let text = texts(&checked);
    for part in ["1 triangle without area", "1 triangle that is there twice", "1 vertex without"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn triangles_with_vertices_of_their_own_are_joined() {
    let whole = sheet(4);
    let points: Vec<Point> = whole.triangles.iter().flatten().map(|&v| whole.points[v as usize]).collect();
    let triangles: Vec<[u32; 3]> =
        (0..whole.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let normals = vec![Vector::z(); points.len()];
    let joined = mesh(Mesh { points, normals, triangles });
    assert_eq!((joined.mesh.points.len(), joined.mesh.normals.len()), (whole.points.len(), 0));
    assert_eq!(joined.mesh.triangles.len(), whole.triangles.len());
    assert!((joined.mesh.area() - whole.area()).abs() < 1e-12);
    let more = 3 * whole.triangles.len() - whole.points.len();
    let note =
        format!("{more} vertices joined with others at the same place: triangles had vertices of their own");
    assert_eq!(texts(&joined), note, "and not told to have pieces");
}

#[test]
fn a_mesh_of_flat_triangles_is_refused() {
    let points = vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(2.0, 0.0, 0.0)];
    let checked = mesh(Mesh { points, normals: vec![], triangles: vec![[0, 1, 2]] });
    assert!(checked.usable().unwrap_err().to_string().contains("none of its 1 triangles"));
}

#[test]
fn single_turned_triangles_follow_their_neighbours() {
    let clean = sheet(6);
    let mut odd = clean.clone();
    [3, 11, 20].into_iter().for_each(|t| odd.triangles[t].swap(1, 2));
    let checked = mesh(odd);
    assert_eq!(checked.mesh.triangles, clean.triangles);
    assert!(texts(&checked).starts_with("3 triangles that face the other way"), "{}", texts(&checked));
}

#[test]
fn where_as_many_triangles_face_either_way_the_form_tells() {
    let whole = ball(16, 6.0);
    let kept = (0..whole.triangles.len()).filter(|&t| whole.corners(t).iter().all(|p| p.z > 4.0));
    let clean = Mesh { triangles: kept.map(|t| whole.triangles[t]).collect(), ..whole.clone() };
    for odd in [0, 1] {
        let mut mixed = clean.clone();
        mixed.triangles.iter_mut().skip(odd).step_by(2).for_each(|corners| corners.swap(1, 2));
        let checked = mesh(mixed);
        assert!(checked.mesh.area() > 0.0 && texts(&checked).contains("the other way than the neighbours"));
        let up = (0..checked.mesh.triangles.len()).filter(|&t| checked.mesh.normal_of(t).z > 0.0).count();
        assert!(up * 10 > checked.mesh.triangles.len() * 9, "{up}");
    }
}

/// A bowl that is seen from within: its form tells the wrong side, but not clearly.
#[test]
fn where_the_form_does_not_tell_the_larger_side_stays() {
    let mut clean = sheet(12);
    clean.points.iter_mut().for_each(|p| p.z += 0.005 * ((p.x - 5.5).powi(2) + (p.y - 5.5).powi(2)));
    let out = inwards::outwardness(&clean).expect("an area");
    assert!((-0.14..-0.01).contains(&out), "{out}");
    let mut mixed = clean.clone();
    let fewer = clean.triangles.len() * 45 / 100;
    mixed.triangles.iter_mut().take(fewer).for_each(|corners| corners.swap(1, 2));
    assert_eq!(mesh(mixed).mesh.triangles, clean.triangles);
}

#[test]
fn of_a_sheet_with_both_sides_the_one_that_faces_outwards_is_left_whatever_the_order() {
    let whole = ball(16, 6.0);
    let kept = (0..whole.triangles.len()).filter(|&t| whole.corners(t).iter().all(|p| p.z > 4.0));
    let fronts: Vec<[u32; 3]> = kept.map(|t| whole.triangles[t]).collect();
    let count = whole.points.len() as u32;
    let backs: Vec<[u32; 3]> = fronts.iter().map(|&[a, b, c]| [a, c, b].map(|v| v + count)).collect();
    let points: Vec<Point> = whole.points.iter().chain(&whole.points).copied().collect();
    let by_turns = fronts.iter().zip(&backs).enumerate();
    let by_turns = by_turns.flat_map(|(i, (f, b))| if i % 3 == 0 { [*b, *f] } else { [*f, *b] });
    for triangles in [
        [fronts.clone(), backs.clone()].concat(),
        [backs.clone(), fronts.clone()].concat(),
        by_turns.collect(),
    ] {
        let checked = mesh(Mesh { points: points.clone(), normals: vec![], triangles });
        let up = (0..checked.mesh.triangles.len()).filter(|&t| checked.mesh.normal_of(t).z > 0.0).count();
        assert_eq!(checked.mesh.triangles.len(), fronts.len());
        assert!(up * 10 > fronts.len() * 9, "{up} of {}: {}", fronts.len(), texts(&checked));
        assert!(!texts(&checked).contains("loose"), "{}", texts(&checked));
    }
}

#[test]
fn one_triangle_with_both_sides_neither_turns_a_hollow_nor_joins_a_slit() {
    // A shell: the inside of its hollow faces the middle.
    let mut shell = ball(16, 7.0);
    let inner = ball(16, 3.0);
    let count = shell.points.len() as u32;
    shell.points.extend(&inner.points);
    shell.triangles.extend(inner.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|v| v + count)));
    let [a, b, c] = shell.triangles[0];
    let double = Mesh { triangles: [&shell.triangles[..], &[[a, c, b]]].concat(), ..shell.clone() };
    let checked = mesh(double);
    assert_eq!((checked.mesh.triangles, checked.mesh.points), (shell.triangles, shell.points));
    // Two sheets that touch, with vertices of their own.
    let (left, mut right) = (sheet(8), sheet(8));
    right.points.iter_mut().for_each(|p| p.x += 7.0);
    let mut both = left.clone();
    both.points.extend(&right.points);
    both.triangles.extend(right.triangles.iter().map(|t| t.map(|v| v + left.points.len() as u32)));
    let [a, b, c] = both.triangles[5];
    both.triangles.push([a, c, b]);
    let checked = mesh(both.clone());
    assert_eq!(checked.mesh.points, both.points, "{}", texts(&checked));
}

/// A single view: a large part, and a hollow beside it that the scanner sees into.
#[test]
fn small_pieces_of_a_sheet_with_both_sides_face_as_the_large_one_does() {
    let mut view = sheet(30);
    view.points.iter_mut().for_each(|p| p.z = -0.02 * ((p.x - 14.5).powi(2) + (p.y - 14.5).powi(2)));
    let mut hollow = sheet(8);
    hollow.points.iter_mut().for_each(|p| p.z = 0.06 * ((p.x - 3.5).powi(2) + (p.y - 3.5).powi(2)));
    let alone = inwards::outwardness(&hollow).expect("an area");
    assert!(alone < -0.2, "by itself it would be turned: {alone}");
    let count = view.points.len() as u32;
    view.points.extend(hollow.points.iter().map(|p| p + nalgebra::Vector3::x() * 40.0));
    view.triangles.extend(hollow.triangles.iter().map(|t| t.map(|v| v + count)));
    let backs: Vec<[u32; 3]> = view.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    for triangles in
        [[view.triangles.clone(), backs.clone()].concat(), [backs, view.triangles.clone()].concat()]
    {
        let checked = mesh(Mesh { triangles, ..view.clone() });
        assert!((0..checked.mesh.triangles.len()).all(|t| checked.mesh.normal_of(t).z > 0.0));
    }
}

#[test]
fn a_spike_does_not_turn_the_scan() {
    let clean = sheet(6);
    let mut odd = clean.clone();
    let [a, b, _] = odd
        .triangles
        .iter()
        .copied()
        .find(|t| Edges::of(&clean).boundary().any(|e| e == [t[0], t[1]]))
        .unwrap();
    odd.points.push(Point::new(1e5, 1e5, 1e5));
    odd.triangles.push([a, b, odd.points.len() as u32 - 1]);
    let checked = mesh(odd);
    assert_eq!(checked.mesh.triangles[..clean.triangles.len()], clean.triangles);
    assert!(texts(&checked).contains("1 triangle that faces"), "{}", texts(&checked));
}

#[test]
fn a_closed_surface_that_faces_inwards_is_turned() {
    let clean = ball(12, 4.0);
    let checked = mesh(Alternative::Flipped.of(&clean));
    assert_eq!(checked.mesh.triangles, clean.triangles);
    assert!(texts(&checked).contains("faced inwards"));
}

#[test]
fn a_one_sided_surface_is_told() {
    // A Moebius strip of five quads.
    let points =
        (0..10).map(|i| Point::new(f64::from(i / 2).cos(), f64::from(i / 2).sin(), f64::from(i % 2)));
    let at = |i: u32| if i < 10 { i } else { 9 - (i - 10) - 8 };
    let quads = (0..5).map(|q| [2 * q, 2 * q + 1, at(2 * q + 2), at(2 * q + 3)]);
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, c, b], [b, c, d]]).collect();
    let checked = mesh(Mesh { points: points.collect(), normals: vec![], triangles });
    assert!(texts(&checked).contains("one-sided"), "{}", texts(&checked));
}

#[test]
fn crowded_edges_and_pieces_are_told() {
    let mut odd = sheet(3);
    odd.points.push(Point::new(0.0, 0.0, 5.0));
    let [a, b, _] = odd.triangles[0];
    let tip = odd.points.len() as u32 - 1;
    odd.triangles.push([a, b, tip]);
    odd.triangles.push([b, a, tip]);
    let far = sheet(3);
    let offset = odd.points.len() as u32;
    odd.points.extend(far.points.iter().map(|p| p + nalgebra::Vector3::repeat(50.0)));
    odd.triangles.extend(far.triangles.iter().map(|t| t.map(|v| v + offset)));
    let text = texts(&mesh(odd));
    assert!(text.contains("2 loose pieces"), "{text}");
}

#[test]
fn coordinates_without_digits_are_refused() {
    let shifted = |by: f64| {
        let mut far = sheet(5);
        far.points
            .iter_mut()
            .for_each(|p| *p = Point::from((p.coords.add_scalar(by)).map(|c| f64::from(c as f32))));
        mesh(far)
    };
    assert_eq!(texts(&shifted(10.0)), "");
    assert!(shifted(1e6).findings.iter().any(|f| f.text.contains("move the object to the origin")));
    assert!(shifted(1e9).is_refused());
    let mut huge = sheet(3);
    huge.points[0].x = 1e300;
    assert!(mesh(huge).is_refused());
}

#[test]
fn training_sets_are_judged_together() {
    let names: Vec<String> = ["a", "b", "c", "d"].map(String::from).to_vec();
    let loaded = |mesh| Loaded { mesh, repairs: vec![] };
    let judge =
        |shapes: Vec<Mesh>| training::set(shapes.into_iter().map(loaded).collect(), &names, Unit::Millimetre);
    let (one, other) = (ball(12, 4.0), ball(12, 5.0));
    let scaled = |factor: f64| {
        let mut mesh = one.clone();
        mesh.points.iter_mut().for_each(|p| *p *= factor);
        mesh
    };
    let set = judge(vec![one.clone(), one.clone(), other.clone()]).ok().unwrap();
    assert_eq!(set.shapes.iter().map(|(n, _)| *n).collect::<Vec<_>>(), [0, 2]);
    let metres = judge(vec![scaled(0.03), scaled(0.031)]).ok().unwrap();
    assert!(
        matches!(&metres.findings[..], [(1, twin), (0, text)] if twin.contains("same shape as a") && text.ends_with("--unit m")),
        "{:?}",
        metres.findings
    );
    assert!(set.findings[0].1.contains("the same shape as a"));
    let refused = |shapes| judge(shapes).err().unwrap().to_string();
    assert!(refused(vec![one.clone()]).contains("there is 1 different"));
    assert!(refused(vec![one.clone(), one.clone()]).contains("copies count once"));
    let mixed = refused(vec![one.clone(), other.clone(), scaled(1e-3)]);
    assert!(mixed.starts_with("c: ") && mixed.contains("another unit"), "{mixed}");
    let halves = refused(vec![one.clone(), other.clone(), scaled(1e-3), scaled(1.1e-3)]);
    let there = format!("the others {:.4};", size::of_mesh(&one));
    assert!(
        halves.starts_with("c: ") && halves.contains(&there),
        "of as many in either, a size that is there: {halves}"
    );
    let cloud = Mesh { triangles: vec![], ..one.clone() };
    assert!(refused(vec![one, cloud, other]).starts_with("b: it has no triangles"));
}

#[test]
fn a_training_shape_that_faces_inwards_is_told() {
    let names: Vec<String> = ["a", "b"].map(String::from).to_vec();
    let [one, other] = [0, 1].map(|number| crate::synth::Head::sample(1, number).mesh());
    let loaded = |mesh| Loaded { mesh, repairs: vec![] };
    let shapes = vec![loaded(one), loaded(Alternative::Flipped.of(&other))];
    let set = training::set(shapes, &names, Unit::Millimetre).ok().unwrap();
    let [(1, text)] = set.findings.as_slice() else { panic!("{:?}", set.findings) };
    assert!(text.starts_with("it seems to face inwards"), "{text}");
}

#[test]
fn flat_triangles_stay_where_vertices_correspond() {
    let names: Vec<String> = ["a", "b"].map(String::from).to_vec();
    let loaded = |mesh: &Mesh| Loaded { mesh: mesh.clone(), repairs: vec![] };
    let one = sheet(5);
    let mut other = one.clone();
    let [a, b, _] = other.triangles[3];
    other.points[a as usize] = other.points[b as usize];
    other.points[40 % one.points.len()].z += 0.5;
    let set = training::set(vec![loaded(&one), loaded(&other)], &names, Unit::Millimetre).ok().unwrap();
    assert!(set.shapes.iter().all(|(_, mesh)| mesh.triangles == one.triangles), "{:?}", set.findings);
    let mut own = one.clone();
    own.triangles.swap(0, 1);
    let set = training::set(vec![loaded(&own), loaded(&other)], &names, Unit::Millimetre).ok().unwrap();
    assert!(set.shapes[1].1.triangles.len() < one.triangles.len());
}

#[test]
fn specks_of_a_training_shape_are_left_out_unless_vertices_correspond() {
    let names: Vec<String> = ["a", "b"].map(String::from).to_vec();
    let loaded = |mesh: &Mesh| Loaded { mesh: mesh.clone(), repairs: vec![] };
    let (clean, mut other) = (sheet(40), sheet(40));
    other.points[40].z += 0.5;
    let with_speck = |mesh: &Mesh| {
        let mut speck = sheet(2);
        speck.points.iter_mut().for_each(|p| p.z += 500.0);
        joined(mesh, &speck)
    };
    let (odd, alike) = (with_speck(&clean), with_speck(&other));
    let set = training::set(vec![loaded(&odd), loaded(&other)], &names, Unit::Millimetre).ok().unwrap();
    assert_eq!(set.shapes[0].1, clean);
    let told: Vec<&str> = set.findings.iter().map(|(_, text)| text.as_str()).collect();
    assert!(told.contains(&"2 triangles of specks left out"), "{told:?}");
    let set = training::set(vec![loaded(&odd), loaded(&alike)], &names, Unit::Millimetre).ok().unwrap();
    assert_eq!(set.shapes[0].1, odd);
    assert!(set.findings[0].1.ends_with("2 loose pieces; all of them are used"), "{:?}", set.findings);
}

#[test]
fn targets_are_of_the_shapes_size() {
    let shapes = [ball(12, 4.0), ball(12, 5.0)];
    let judge = |factor: f64| {
        let mut mesh = shapes[0].clone();
        mesh.points.iter_mut().for_each(|p| *p *= factor);
        training::target(Loaded { mesh, repairs: vec![] }, &shapes, Unit::Millimetre)
    };
    assert!(!judge(1.2).is_refused() && !texts(&judge(1.2)).contains("training shapes"));
    assert!(texts(&judge(1.0)).contains("one of the training shapes"), "{}", texts(&judge(1.0)));
    assert!(texts(&judge(1e-3)).contains("another unit"), "{}", texts(&judge(1e-3)));
    let cloud = Loaded { mesh: Mesh { triangles: vec![], ..shapes[0].clone() }, repairs: vec![] };
    assert!(training::target(cloud, &shapes, Unit::Millimetre).is_refused());
}
