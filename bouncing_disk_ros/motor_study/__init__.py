"""The ultrasonic motor over two of its parameters."""
