"""Many runs at once on a graphics processor, one thread each: the machine code of parts for it, and memory there."""
