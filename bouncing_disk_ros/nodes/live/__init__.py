"""Small executables beside a running simulator: `perform` commands it, `echo_impacts` prints."""
