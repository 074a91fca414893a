"""A subtree placed N times, by native instances and by PointInstancers."""
