//! `lacuna device` against a device at a TCP address.

use lacuna_tests::program::{json, refuses, succeeds};
use lacuna_tests::tcp_device;
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
    for same in ["digests", "verdict", "scan_to_model", "hull_voxels"] {
        assert_eq!(reports[0][same], reports[1][same], "{same}");
    }
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
    let golden = lacuna_fixtures::GOLDEN.iter().find(|golden| golden.name == "built-in").unwrap();
    assert_eq!(reports[0]["device"]["local"], golden.local);
    assert_eq!(reports[0]["device"]["distances"], golden.distances);
}

#[test]
fn info_names_machine_and_model() {
    let folder = tempdir().unwrap();
    let address = tcp_device::start(lacuna_fixtures::MODEL);
    let info = json(folder.path(), &["device", "info", "--json", "--tcp", &address]);
    assert_eq!((&info["machine"], &info["model"]["Ok"]["class"]), (&"test".into(), &"head".into()));
    let text = succeeds(folder.path(), &["device", "info", "--tcp", &address]);
    assert!(text.contains("machine         test") && text.contains("40000 points"), "{text}");
}

#[test]
fn a_device_that_is_not_there_is_named() {
    let folder = tempdir().unwrap();
    let complaint = refuses(folder.path(), &["device", "info", "--tcp", "127.0.0.1:9"]);
    assert!(complaint.contains("cannot reach 127.0.0.1:9"), "{complaint}");
    let complaint = refuses(folder.path(), &["device", "info", "--serial", "/no/such/port"]);
    assert!(complaint.contains("/no/such/port"), "{complaint}");
    let complaint = refuses(folder.path(), &["device", "info", "--qemu", "m7", "--firmware", "nothing.elf"]);
    assert!(complaint.contains("there is no firmware at nothing.elf"), "{complaint}");
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
