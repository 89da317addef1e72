"""The ground in the certificate: height maps and columns, feet on it, and legs clear of it."""
