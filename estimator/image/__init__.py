"""From a grey image to the features s (and the axis a) with their covariance."""
