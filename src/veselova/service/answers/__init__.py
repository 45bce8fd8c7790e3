"""From one request to one answer: limits, validation, work, rendering."""
