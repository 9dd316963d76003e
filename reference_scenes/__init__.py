"""What is rendered: the scene model, canonical families with their expectations, exporters."""
