"""What is said and what is kept: message schemas, the topic table, MCAP logs."""
