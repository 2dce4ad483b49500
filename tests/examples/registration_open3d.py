"""Open3D's RANSAC over FPFH features with scale, then ICP with scale, on what `registration --export DIR` wrote:

    python3 registration_open3d.py DIR [LACUNA]

A pose counts as found within 10 degrees and 15 class millimetres of the known one. With the path of a `lacuna`
program and models in DIR (class_0.lacuna, class_1.lacuna), that program's `register` is measured the same way.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np
import open3d as o3d

REGISTRATION = o3d.pipelines.registration


def features(cloud, radius):
    neighbours = o3d.geometry.KDTreeSearchParamHybrid(radius=radius, max_nn=100)
    return REGISTRATION.compute_fpfh_feature(cloud, neighbours)


def cloud_of(mesh, spacing):
    mesh.compute_vertex_normals()
    cloud = o3d.geometry.PointCloud(mesh.vertices)
    cloud.normals = mesh.vertex_normals
    return cloud.voxel_down_sample(spacing)


def ransac(scan, target, wanted, reach, scale):
    """From the scan to voxels. Features are made at the class's size, since FPFH needs a radius."""
    cloud = cloud_of(scan.scale(scale, (0, 0, 0)), 0.4 * reach)
    point_to_point = REGISTRATION.TransformationEstimationPointToPoint(True)
    checks = [REGISTRATION.CorrespondenceCheckerBasedOnDistance(reach)]
    criteria = REGISTRATION.RANSACConvergenceCriteria(100000, 0.999)
    found = REGISTRATION.registration_ransac_based_on_feature_matching(
        cloud, target, features(cloud, 2.0 * reach), wanted, True, reach, point_to_point, 3, checks, criteria
    )
    fine = REGISTRATION.registration_icp(cloud, target, reach, found.transformation, point_to_point)
    return fine.transformation @ np.diag([scale, scale, scale, 1.0])


def lacuna(program, scan, model):
    text = subprocess.run(
        [program, "register", scan, "--model", model, "--json", "--threads", "2"], capture_output=True, text=True
    ).stdout
    found = json.loads(text) if text else {"scan_to_model": np.zeros((4, 4)), "seconds": 0.0}
    return np.array(found["scan_to_model"]), found["seconds"]


def difference(found, known, points):
    """Degrees and root mean square motion of the class's points, voxels."""
    with np.errstate(all="ignore"):
        motion = found @ np.linalg.inv(known)
        turn = motion[:3, :3] / np.cbrt(np.linalg.det(motion[:3, :3]))
        degrees = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    moved = points @ motion[:3, :3].T + motion[:3, 3]
    return degrees, np.sqrt(((moved - points) ** 2).sum(1).mean())


def main():
    folder = sys.argv[1]
    program = sys.argv[2] if len(sys.argv) > 2 else None
    about = json.load(open(os.path.join(folder, "poses.json")))
    o3d.utility.random.seed(1)
    classes = []
    for number, millimetre in enumerate(about["voxels_per_class_millimetre"]):
        mesh = o3d.io.read_triangle_mesh(os.path.join(folder, f"class_{number}.ply"))
        reach = 10.0 * millimetre
        target = cloud_of(mesh, 0.4 * reach)
        classes.append((target, features(target, 2.0 * reach), reach, millimetre))
    results = {}
    for trial in about["trials"]:
        target, wanted, reach, millimetre = classes[trial["class"]]
        known = np.array(trial["scan_to_voxels"]).reshape(4, 4)
        path = os.path.join(folder, trial["scan"])
        start = time.process_time()
        if program:
            model = os.path.join(folder, f"class_{trial['class']}.lacuna")
            found, seconds = lacuna(program, path, model)
            found = np.array(trial["shapes_to_voxels"]).reshape(4, 4) @ found
        else:
            scan = o3d.io.read_triangle_mesh(path)
            found = ransac(scan, target, wanted, reach, trial["voxels_per_unit"])
            seconds = time.process_time() - start
        degrees, moved = difference(found, known, np.asarray(target.points))
        same = degrees < 10 and moved < 15 * millimetre
        results.setdefault(trial["subject"], []).append((same, seconds, degrees, moved / millimetre))
    print("| scan | found | seconds, median |\n|---|---|---|")
    results["all"] = [r for rows in list(results.values()) for r in rows]
    for name, rows in results.items():
        print(f"| {name} | {sum(r[0] for r in rows)} of {len(rows)} | {np.median([r[1] for r in rows]):.3f} |")


if __name__ == "__main__":
    main()
