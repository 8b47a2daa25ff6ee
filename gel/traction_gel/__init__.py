"""Makes the influence file of a gel of any shape, from its geometry: docs/fingertip.md."""
