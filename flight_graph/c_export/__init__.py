"""Components as C: a header, a static library of their machine code, and a program that flies a recorded bag's inputs."""
