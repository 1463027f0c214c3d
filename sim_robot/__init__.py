"""The PyBullet Panda stand-in: blocks, scenes, camera, motions, and a robot node on the wire."""
