"""Linear programmes for impulse sequences, and what makes their solutions exact."""
