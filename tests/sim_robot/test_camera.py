import numpy as np
import pybullet
import pytest

from grasping_invisible.sim_robot.camera import DepthSensor, default_camera, render


@pytest.fixture
def client():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(physicsClientId=client)


def add_box(client, center, half):
    visual = pybullet.createVisualShape(
        pybullet.GEOM_BOX, halfExtents=half, rgbaColor=[1, 0, 0, 1], physicsClientId=client
    )
    return pybullet.createMultiBody(0, -1, visual, center, physicsClientId=client)


@pytest.mark.parametrize("center", [(0.5, 0.0, 0.02), (0.35, 0.15, 0.05), (0.66, -0.18, 0.01)])
def test_a_box_appears_where_the_calibration_says(client, center):
    camera = default_camera()
    box = add_box(client, center, [0.02, 0.02, 0.01])
    image = render(client, camera)
    rows, columns = np.nonzero(image.bodies == box)
    z = image.depth[rows, columns]
    x = (columns - camera.intrinsics[0, 2]) / camera.intrinsics[0, 0] * z
    y = (rows - camera.intrinsics[1, 2]) / camera.intrinsics[1, 1] * z
    points = (camera.base_from_camera @ np.stack([x, y, z, np.ones_like(z)]))[:3]
    top = points[:, points[2] > center[2] + 0.009]
    middle = (top[:2].max(axis=1) + top[:2].min(axis=1)) / 2
    np.testing.assert_allclose(middle, center[:2], atol=0.0012)
    assert np.median(top[2]) == pytest.approx(center[2] + 0.01, abs=0.001)


def test_the_whole_workspace_is_in_view():
    camera = default_camera()
    camera_from_base = np.linalg.inv(camera.base_from_camera)
    for x in (0.306, 0.754):
        for y in (-0.224, 0.224):
            for z in (0.0, 0.12):
                point = camera_from_base @ np.array([x, y, z, 1.0])
                u, v, w = camera.intrinsics @ point[:3]
                assert 0 <= u / w < camera.width
                assert 0 <= v / w < camera.height


def test_sensor_depth_is_whole_millimetres_repeatable_and_keeps_holes():
    exact = np.full((40, 50), 0.8, np.float32)
    exact[:5] = 0.0
    first, second = DepthSensor(3).measure(exact), DepthSensor(3).measure(exact)
    np.testing.assert_array_equal(first, second)
    assert (first[:5] == 0).all()
    np.testing.assert_allclose(first * 1000, np.round(first * 1000), atol=1e-3)
    assert 0.0003 < first[5:].std() < 0.0015
