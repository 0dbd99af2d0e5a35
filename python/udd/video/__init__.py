"""Films in and out: reader, writer, webcam and colour."""
