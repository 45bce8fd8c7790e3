"""The core of every problem: its data in exact numbers, times, exceptions, and what a flow is."""
