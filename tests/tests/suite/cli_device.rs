//! `lacuna device` against a device at a TCP address.

use lacuna_tests::program::{json, lacuna, refuses, succeeds};
use lacuna_tests::tcp_device;
use std::net::TcpListener;
use tempfile::tempdir;

#[test]
fn a_device_completes_the_example_scan_to_the_byte() {
    let folder = tempdir().unwrap();
    let address = tcp_device::start(lacuna_fixtures::MODEL);
    let found = succeeds(folder.path(), &["register", "--json"]);
    std::fs::write(folder.path().join("pose.json"), found).unwrap();
    let surfaces =
        |name: &str| [format!("{name}.ply"), format!("{name}_local.ply"), format!("{name}_global.ply")];
    let mut reports = vec![];
    for (command, name) in
        [(vec!["complete"], "host"), (vec!["device", "complete", "--tcp", &address], "device")]
    {
        let [out, local, global] = surfaces(name);
        let options = ["--json", "--pose-hint", "pose.json", "--no-picture"];
        let outputs = ["-o", &out, "--local-surface", &local, "--global-surface", &global];
        reports.push(json(folder.path(), &[&command[..], &options, &outputs].concat()));
    }
    for (host, device) in surfaces("host").iter().zip(&surfaces("device")) {
        let read = |name: &String| std::fs::read(folder.path().join(name)).unwrap();
        assert!(read(host) == read(device), "{host} and {device} differ");
    }
    let [host, device] = [&reports[0], &reports[1]].map(|report| report.as_object().expect("an object"));
    for (field, value) in host {
        match field.as_str() {
            "output" | "seconds" => {}
            // The hull stays on the device.
            "mirrored_voxels" => {
                assert!(value.is_u64() && device[field].is_null(), "{value} {}", device[field])
            }
            "device" => {
                assert!(value.is_null(), "{value}");
                let told = &device[field];
                assert!(told["counters"]["pose"]["steps"].as_u64() > Some(0), "{told}");
                assert!(told["line"]["sent"].as_u64() > Some(0), "{told}");
            }
            _ => assert_eq!(value, &device[field], "{field}"),
        }
    }
}

/// A scan of the built-in class, small.
fn synthetic(folder: &std::path::Path, view: &str) {
    succeeds(folder, &["synth", "scan", "scan", "--small", "--view", view]);
}

#[test]
fn a_device_makes_the_points_of_a_depth_image_itself() {
    let folder = tempdir().unwrap();
    synthetic(folder.path(), "front");
    let address = tcp_device::start(lacuna_fixtures::MODEL);
    let options = ["scan/scan.json", "--depth-rows", "--no-picture", "--json", "-o"];
    let host = json(folder.path(), &[&["complete"], &options[..], &["host.ply"]].concat());
    let device = ["device", "complete", "--tcp", &address];
    let device = json(folder.path(), &[&device, &options[..], &["device.ply"]].concat());
    assert_eq!(host["digests"], device["digests"]);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("host.ply") == read("device.ply"));
    // The same scan by way of its mesh: other points, the same face.
    let options = ["scan/scan.json", "--no-picture", "--json", "-o", "mesh.ply"];
    let mesh = json(folder.path(), &[&["complete"], &options[..]].concat());
    assert_ne!(host["digests"], mesh["digests"]);
    let scale = |report: &serde_json::Value| report["verdict"]["scale"].as_f64().unwrap();
    assert!((scale(&host) / scale(&mesh) - 1.0).abs() < 0.02, "{host} {mesh}");
    assert_eq!(host["verdict"]["grade"], mesh["verdict"]["grade"]);
}

#[test]
fn depth_rows_need_one_depth_image() {
    let folder = tempdir().unwrap();
    let misused = |arguments: &[&str]| {
        let output = lacuna(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let complaint = misused(&["complete", "--depth-rows"]);
    assert!(complaint.contains("--depth-rows goes with a depth PNG or a scan.json"), "{complaint}");
    synthetic(folder.path(), "stitched");
    let complaint = misused(&["complete", "scan", "--depth-rows", "--flip"]);
    assert!(complaint.contains("--flip does not go with --depth-rows"), "{complaint}");
    let complaint = refuses(folder.path(), &["complete", "scan", "--depth-rows"]);
    assert!(complaint.contains("has 3 views, --depth-rows takes one: name its PNG file"), "{complaint}");
}

#[test]
fn a_device_verifies_the_example_and_synthetic_scans() {
    let folder = tempdir().unwrap();
    let address = tcp_device::start(lacuna_fixtures::MODEL);
    let reports = json(folder.path(), &["device", "verify", "--json", "--tcp", &address]);
    let reports = reports.as_array().unwrap();
    assert_eq!(reports.len(), 6);
    for report in reports {
        assert_eq!(report["host"], report["device"], "{report}");
    }
    let completed = json(folder.path(), &["complete", "--no-picture", "--json"]);
    assert_eq!(reports[0]["device"], completed["digests"], "what a completion fits");
}

#[test]
fn info_names_machine_and_model() {
    let folder = tempdir().unwrap();
    let address = tcp_device::start(lacuna_fixtures::MODEL);
    let info = json(folder.path(), &["device", "info", "--json", "--tcp", &address]);
    assert_eq!((&info["machine"], &info["refused"]), (&"test".into(), &serde_json::Value::Null));
    let inspected = json(folder.path(), &["inspect", "--json"]);
    for field in ["class", "checksum", "unit", "modes", "voxels"] {
        assert_eq!(info["model"][field], inspected[field], "{field}");
    }
    let text = succeeds(folder.path(), &["device", "info", "--tcp", &address]);
    assert!(text.contains("machine         test") && text.contains("40000 points"), "{text}");
}

#[test]
fn a_device_that_is_not_there_is_named() {
    let folder = tempdir().unwrap();
    // A port that nobody listens at any more.
    let address = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    let address = address.expect("a free port").to_string();
    let complaint = refuses(folder.path(), &["device", "info", "--tcp", &address]);
    assert!(complaint.contains(&format!("cannot reach {address}")), "{complaint}");
    let complaint = refuses(folder.path(), &["device", "info", "--serial", "/no/such/port"]);
    assert!(complaint.contains("/no/such/port"), "{complaint}");
    let complaint = refuses(folder.path(), &["device", "info", "--qemu", "m7", "--firmware", "nothing.elf"]);
    assert!(complaint.contains("there is no firmware at nothing.elf"), "{complaint}");
    std::fs::write(folder.path().join("text.elf"), "no program, but long enough for its head").unwrap();
    let complaint = refuses(folder.path(), &["device", "info", "--qemu", "m7", "--firmware", "text.elf"]);
    assert!(complaint.contains("text.elf is no firmware for m7"), "{complaint}");
    for of_another in [["--firmware", "nothing.elf"], ["--baud", "9600"]] {
        let output =
            lacuna(folder.path(), &[&["device", "info", "--tcp", &address], &of_another[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{output:?}");
    }
}

#[test]
fn a_device_with_another_model_or_none_refuses_the_scan() {
    let folder = tempdir().unwrap();
    let other: &'static [u8] = lacuna_host::verify::Case::small().unwrap().model.leak();
    let address = tcp_device::start(other);
    let complaint = refuses(folder.path(), &["device", "complete", "--tcp", &address]);
    assert!(complaint.contains("the device holds the model"), "{complaint}");
    let address = tcp_device::start(&[0; 100]);
    let complaint = refuses(folder.path(), &["device", "complete", "--tcp", &address]);
    assert!(complaint.contains("its model is not a Lacuna model"), "{complaint}");
}
