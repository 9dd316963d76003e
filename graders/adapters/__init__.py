"""Adapters that make renderers from elsewhere submissions."""
