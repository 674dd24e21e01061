# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Points of a frame as a cloud: a NumPy array, or an Open3D point cloud if that is installed."""


def cloud(frame):
    """Returns the valid points of a frame, (N, 3), m; x right, y down, z forward, from the optical centre.

    @param frame a frame with the channel `points`, or an array of shape (.., 3)
    @throws KeyError without `points`, ValueError for another shape
    """
    import numpy
    points = numpy.asarray(frame if isinstance(frame, numpy.ndarray) else frame["points"])
    if points.ndim < 1 or points.shape[-1] != 3:
        raise ValueError(f"points have the shape (.., 3), not {points.shape}")
    points = points.reshape(-1, 3)
    return points[numpy.isfinite(points).all(axis=1)]


def open3d_cloud(frame):
    """Returns the valid points of a frame as open3d.geometry.PointCloud (a copy); see cloud().

    @throws ImportError without Open3D
    """
    try:
        import open3d
    except ImportError as error:
        raise ImportError("Open3D is not installed (Debian: python3-open3d); tofgraph.cloud() gives the same points "
                          "as an array") from error
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud(frame).astype("float64")))
