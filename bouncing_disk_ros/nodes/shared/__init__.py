"""What executables of several rooms need: start, options, figure kinds, what topics say."""
