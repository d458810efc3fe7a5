"""Laws compared, and the paper's simulations reproduced."""
