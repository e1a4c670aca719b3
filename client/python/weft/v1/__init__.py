"""Messages and stubs of proto/weft/v1, whose comments are the manual."""
