"""Files of amplifiers: the text of one enters, the law that its manual makes of it and what that does leave."""
