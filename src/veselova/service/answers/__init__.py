"""From one request to one answer: limits, validation, cache, rendering."""
