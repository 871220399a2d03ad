"""`replay`: a recorded run simulated again from its inputs."""
