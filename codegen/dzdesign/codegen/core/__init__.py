"""The core that all targets share: the law of a `Compensator` enters, its integer arithmetic and C leave."""
