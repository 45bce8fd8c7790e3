"""Worker processes of bounded memory and time, and the tasks that run in them."""
