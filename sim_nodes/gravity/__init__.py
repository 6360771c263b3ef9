"""Gravity of a small body at a point and at a landing site: point mass, ellipsoid, superellipsoid, a user's own
mesh.

ellipsoid.py       gravity of a homogeneous ellipsoid in closed form, and landing sites on it
polyhedron.py      gravity and its gradient of a homogeneous polyhedron, as kernels
mesh.py            closed triangle meshes: reading, checks, volume, icosahedral spheres
superellipsoid.py  a spinning-top body in closed form, and its mesh
bodies.py          bodies by name: a surface by latitude and longitude, and gravity outside it
site.py            a site on a body: effective gravity, slope, gradient and spin in its east, north, up frame
"""
