"""What is true: closed forms of light, the statistics of judging, ray casting."""
